//! What planners ask of a map, each question at one revision unless others go first meanwhile: does a body fit, at
//! poses and along motions; where rays end; what is nearest; what the map is seen from above.
//!
//! [`Body`] is what is asked about, [`Planner`] answers, and [`PlanningView`] has the questions.
//! `clearance` defines when a ball meets a voxel, and is what makes the answers fast; `check` asks it about bodies.
//! Each other question is a function of a [`MapView`](crate::map::MapView) and a request of plain slices, and answers
//! with plain arrays.

mod answers;
mod body;
mod check;
mod clearance;
mod effort;
mod error;
mod frontiers;
mod grid;
mod keep_outs;
mod nearest;
mod planner;
mod rays;
mod recent_clusters;
mod simd;
#[cfg(test)]
mod tests;
mod unknown;

pub use answers::{CLEARANCE_CELLS_MAX, Clearance, Hit, Met, clearance_max_m};
pub use body::{
    Body, COVER_SPHERES_MAX, Configurations, CoverError, Link, NUMBERS_PER_POSE, PlacedPart, Sphere,
    cover_box, cover_capsule,
};
pub use check::{MotionAnswer, MotionQuestion, PoseQuestion, SphereGroups, SphereQuestion, prepared_bytes};
pub use clearance::FIELD_BYTES_MAX_DEFAULT;
pub use error::{Before, PlanningError, SpherePlace};
pub use frontiers::{
    FRONTIER_SIZE_MIN_DEFAULT, Frontier, FrontierError, FrontierRequest, FrontierView, Frontiers,
    STANDOFF_VOXELS, STANDOFF_VOXELS_MAX, list_frontiers,
};
pub use grid::{
    BandFrom, Floor, Grid, GridArea, GridError, GridExtent, GridRequest, find_floor, grid_extent,
    project_grid, project_grid_above,
};
pub use nearest::{MeasuredTo, NearestError, NearestRequest, NearestVoxels, RADIUS_VOXELS_MAX, find_nearest};
pub use planner::{Planner, PlanningView};
pub use rays::{DIRECTION_LENGTH_TOLERANCE, RayError, RayHits, Rays, Toward, cast_rays, cast_rays_in_sight};
pub use unknown::{OutOfRange, PointState, PointStates, Surroundings, Unknown, classify_points};
