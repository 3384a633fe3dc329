//! The clearance field: how far it is from the middle of a cell to the nearest occupied voxel, at every level.
//!
//! ```text
//! field      a level's cells, a byte each            FieldLevel
//! cluster    8 x 8 x 8 blocks                        FieldCluster: numbers of blocks, and the blocks
//! block      8 x 8 x 8 cells, made when asked for    FieldBlock: 512 bytes
//! byte       4 d^2 for the distance d in cells, exact below 255; 255: that or more
//! ```
//!
//! Four times the squared distance from the middle of a cell to a closed cube is a sum of three squares of odd numbers,
//! or zeros: a whole number, so that the byte is exact up to almost eight cells. By the triangle inequality it bounds
//! the distance of every point of the cell from both sides.
//!
//! Blocks with nothing within eight cells are one shared block. What a change touches is forgotten, and made again when
//! it is asked for. A coarser level has a field of its own, which tells of distances beyond eight cells.
//!
//! `eight_points` reads bounds of eight distances from it at once, and `small_balls` whether a small ball meets a
//! voxel. `cube_search` searches the voxels themselves, exactly, where the field does not decide; it defines when a
//! ball meets one.

mod block;
mod cluster;
mod cube_search;
pub(super) mod eight_points;
mod fields;
mod level;
pub(super) mod small_balls;

#[cfg(test)]
pub(super) use cube_search::squared_distance;
pub(super) use cube_search::{CubeSearch, NearestCube};
pub(super) use eight_points::{Bounds, Centers, Found, LANES, lane_of, lanes_below_zero};
pub use fields::FIELD_BYTES_MAX_DEFAULT;
pub(super) use fields::{FieldBlockKey, Fields};
pub(super) use small_balls::BallState;
