//! Checks of bodies: at poses, along motions, and spheres in groups.

mod answer_kind;
mod configuration;
mod field_lookup;
mod found_spheres;
mod link;
mod motions;
mod pipeline;
mod points;
mod poses;
mod rounds;
mod single_link;
mod spheres;

#[cfg(test)]
pub(super) use field_lookup::UNMADE_MAX;
pub use motions::{MotionAnswer, MotionQuestion, prepared_bytes};
pub use poses::PoseQuestion;
pub use spheres::{SphereGroups, SphereQuestion};
