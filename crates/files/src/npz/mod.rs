//! Arrays of numpy: a map's voxels as `.npz`, which `numpy.load` reads without pickle.
//!
//! | array | type, shape | holds |
//! |---|---|---|
//! | `points` | float64 (n, 3) | centers of the voxels, meters, the map's origin added |
//! | `indices` | int32 (n, 3) | indices: voxel i j k spans `[i, i + 1) * resolution` of the map frame in x |
//! | `resolution` | float64 () | side of a voxel, meters |
//! | `origin` | float64 (3,) | the map's origin in the survey, meters; 0 0 0 where the map has none |
//! | `level` | int64 () | level of the voxels in the map they are of |
//! | `revision` | uint64 () | revision of that map |
//!
//! Reading takes `indices` with `resolution`, or `points` alone, of any type of numbers, compressed or not.

mod error;
mod reader;
mod rows;
mod writer;

pub use error::NpzError;
pub use reader::{NpzContent, NpzReader};
pub use writer::VoxelArrays;
