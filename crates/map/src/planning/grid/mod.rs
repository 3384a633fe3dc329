//! The map from above: which cells of a grid in x y have a voxel that reaches into a band of height, and how
//! high it reaches.

mod cells;
mod extent;
mod floor;
#[cfg(test)]
mod floor_misled;
#[cfg(test)]
mod floor_scenes;
mod free;
mod keep_outs;
mod map_server;
mod occupancy_grid;
mod project;
mod projection;
mod request;
#[cfg(test)]
mod tests;

pub use extent::{GridExtent, grid_extent};
pub use floor::{Floor, find_floor};
pub use occupancy_grid::Grid;
pub use project::{project_grid, project_grid_above};
pub use request::{BandFrom, GridArea, GridError, GridRequest};
