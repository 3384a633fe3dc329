//! Rivals: structures that answer the same query, "which of these points are in occupied voxels?", from the same points
//! and pose with the same bitmap. All get the fastest transform available, so that only the structure differs.

mod dense;
mod hash_set;
mod hash_tables;
mod ours;
mod paper;
mod structure;
mod structure_name;
mod weighted_sum;

pub use dense::{DENSE_BYTES_MAX, Dense, DenseTooLarge, Grid, offsets};
pub use hash_set::{HashSet, hash_set_bytes};
pub use hash_tables::HashTables;
pub use ours::{Kernel, ThroughMap, filter_contains, query_scalar};
pub use paper::PaperFilter;
pub use structure::Structure;
pub(super) use structure::bits;
pub use structure_name::StructureName;
pub use weighted_sum::WeightedSum;
