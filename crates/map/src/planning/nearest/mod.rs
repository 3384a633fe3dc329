//! The nearest voxel of points: how far away it is, and which way leads away from it.

mod block;
mod find;
mod keep_outs;
mod nearest_voxels;
mod request;
mod search;
mod seeker;
#[cfg(test)]
mod tests;

pub use find::find_nearest;
pub use nearest_voxels::NearestVoxels;
pub use request::{MeasuredTo, NearestError, NearestRequest, RADIUS_VOXELS_MAX};
