//! Voxels: packed keys (paper II-B), the lattice that quantizes points (II, III) and volumetric sampling
//! (III-A).

mod block;
mod block_table;
mod cluster;
mod gained;
mod grouping;
mod key;
mod lattice;
mod moments;
mod renewal;
mod sample;
mod set;
mod slots;

pub use block::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell};
pub use block_table::BlockTable;
pub(crate) use cluster::{CLUSTER_LEVELS, CacheLine, Cluster, Place};
pub use key::{INDEX_MAX, INDEX_MIN, VoxelKey};
pub use lattice::{LEVELS_MAX, Lattice, LatticeFromPoints, RESOLUTION_MAX_M, RESOLUTION_MIN_M, SettingError};
pub use moments::{MOMENT_LEVEL, MomentSet, Moments};
pub(crate) use renewal::Renewal;
pub use sample::{VolumetricSample, sample_bytes_max, volumetric_sample, volumetric_sample_until};
pub(crate) use set::BLOCKS_PER_LOOK;
pub use set::VoxelSet;
pub(crate) use slots::{BUCKET, Bucket, Slots};
