//! What planners ask of a map, each question at one revision: does a body fit, at poses and along motions; where rays end;
//! what is nearest; what the map is seen from above.
//!
//! Of bodies, [`Body`] is what is asked about, [`Planner`] who is asked, and [`PlanningView`] has the questions. `cubes` defines
//! when a ball meets a voxel; `clearance` is what makes the answers fast. Each other question is a function of a
//! [`MapView`](crate::map::MapView) and a request of plain slices, and answers with plain arrays.

mod aim;
mod answers;
mod body;
mod classify;
mod clearance;
mod configurations;
mod cover;
mod cubes;
mod effort;
mod eight;
mod error;
mod free_space;
mod frontiers;
mod grid;
mod in_cells;
#[cfg(test)]
mod in_sight_tests;
mod keep_outs;
mod kind;
mod link;
mod look;
mod motions;
mod nearby;
mod nearest;
mod obstacles;
mod one;
mod parts;
mod path;
mod placement;
mod planner;
mod points;
mod poses;
mod prepared;
mod rays;
mod reach;
mod remembered;
mod rigid;
mod rounds;
#[cfg(test)]
mod seen_maps;
mod simd;
mod spheres;
mod steps;
#[cfg(test)]
mod stop_tests;
mod surroundings;
#[cfg(test)]
mod test_maps;
#[cfg(test)]
mod tests;

pub use answers::{CLEARANCE_CELLS_MAX, Clearance, Hit, Met, clearance_max_m};
pub use body::Body;
pub use classify::{OutOfRange, PointState, PointStates, classify_points};
pub use clearance::FIELD_BYTES_MAX_DEFAULT;
pub use configurations::{Configurations, NUMBERS_PER_POSE};
pub use cover::{COVER_SPHERES_MAX, CoverError, cover_box, cover_capsule};
pub use error::{PlanningError, SpherePlace};
pub use frontiers::{
    FRONTIER_SIZE_MIN_DEFAULT, Frontier, FrontierError, FrontierRequest, FrontierView, Frontiers,
    STANDOFF_VOXELS, STANDOFF_VOXELS_MAX, list_frontiers,
};
pub use grid::{Grid, GridArea, GridError, GridRequest, project_grid};
pub use motions::{MotionAnswer, MotionQuestion, prepared_bytes};
pub use nearest::{MeasuredTo, NearestError, NearestRequest, NearestVoxels, RADIUS_VOXELS_MAX, find_nearest};
pub use parts::{Link, Sphere};
pub use planner::{Planner, PlanningView};
pub use poses::PoseQuestion;
pub use rays::{DIRECTION_LENGTH_TOLERANCE, RayError, RayHits, Rays, Toward, cast_rays, cast_rays_in_sight};
pub use reach::PlacedPart;
pub use spheres::{SphereGroups, SphereQuestion};
pub use surroundings::{Surroundings, Unknown};
