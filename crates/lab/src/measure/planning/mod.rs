//! Measurement of planners' questions: an arm at poses, a body of points, motions, and what all that costs a map that
//! changes.

mod arms;
mod changing;
mod motions;
mod points;
#[cfg(test)]
mod tests;

pub(crate) use arms::meets;
pub use arms::{ArmPoses, arm_poses, write_arms};
pub use changing::{Changing, between_insertions};
pub(crate) use motions::half_colliding;
pub use motions::{Motions, motions};
pub use points::{PointBody, point_body};
