//! Frontiers: where free space ends and nothing is known beyond, and from where each can be seen. What explorers go to.

mod clusters;
mod frontier;
mod list;
mod request;
#[cfg(test)]
mod tests;
mod view_pose;
mod window;

pub use frontier::{Frontier, FrontierView, Frontiers};
pub use list::list_frontiers;
pub use request::{
    FRONTIER_SIZE_MIN_DEFAULT, FrontierError, FrontierRequest, STANDOFF_VOXELS, STANDOFF_VOXELS_MAX,
};
