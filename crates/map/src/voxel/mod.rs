//! Voxels: packed keys (paper II-B), the lattice that quantizes points (II, III) and volumetric sampling
//! (III-A).

mod block;
mod block_sort;
mod cluster;
mod cluster_table;
mod cluster_update;
mod key;
mod lattice;
mod moment_set;
mod moments;
mod new_keys;
pub mod quantize;
mod sample;
mod set;
mod slots;

pub use block::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell};
#[cfg(target_arch = "x86_64")]
pub(crate) use cluster::CacheLine;
pub(crate) use cluster::{BlockInCluster, CLUSTER_LEVELS, CLUSTER_SIDE, Cluster};
pub use cluster_table::ClusterTable;
pub(crate) use cluster_update::ClusterUpdate;
pub use key::{INDEX_MAX, INDEX_MIN, VoxelKey};
pub use lattice::{LEVELS_MAX, Lattice, LatticeFromPoints, RESOLUTION_MAX_M, RESOLUTION_MIN_M, SettingError};
pub use moment_set::MomentSet;
pub use moments::{MOMENT_LEVEL, Moments};
pub use sample::{VolumetricSample, sample_bytes_max, volumetric_sample, volumetric_sample_until};
pub use set::BLOCKS_PER_STOP_CHECK;
pub use set::VoxelSet;
pub(crate) use slots::Slots;
#[cfg(target_arch = "x86_64")]
pub(crate) use slots::{BUCKET, Bucket};
