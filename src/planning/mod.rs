//! What planners ask of a map: does a body fit, at poses and along motions.
//!
//! Reading order: [`Body`] is what is asked about, [`Planner`] who is asked, [`PlanningView`] the questions, all answered
//! at one revision. `cubes` defines when a ball meets a voxel; `clearance` is what makes the answers fast.

mod body;
mod clearance;
mod configurations;
mod cubes;
mod eight;
mod error;
mod in_cells;
mod kind;
mod link;
mod look;
mod motions;
mod nearby;
mod one;
mod path;
mod placement;
mod planner;
mod points;
mod poses;
mod simd;
mod spheres;
mod surroundings;
#[cfg(test)]
mod tests;

pub use body::{Body, Link, Sphere};
pub use clearance::FIELD_BYTES_MAX_DEFAULT;
pub use configurations::{Configurations, NUMBERS_PER_POSE};
pub use error::PlanningError;
pub use kind::{CLEARANCE_CELLS_MAX, Clearance, Hit};
pub use motions::{MotionAnswer, MotionQuestion};
pub use planner::{Planner, PlanningView};
pub use poses::PoseQuestion;
pub use spheres::{SphereGroups, SphereQuestion};
pub use surroundings::Surroundings;
