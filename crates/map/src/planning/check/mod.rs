//! Checks of bodies: at poses, along motions, and spheres in groups.
//!
//! A motion's way through its check, and the files of each step:
//!
//! ```text
//! MotionQuestion
//!       |   the body in cells of the level                   body::prepared, body::in_cells
//!       |   a segment between two configurations, its steps  motions, body::path
//!       v
//! 16 motions at a time, in rounds <------------------+       rounds, simd
//!       |                                            |
//!       v                                            |
//! a link at a step: its pose, its transform          |       motions, body::path, body::placement
//!       |                                            |
//!       v                                            |
//! the ball around it ---- clear: steps are skipped   |       link, field_lookup, clearance::eight_points
//!       | near                                       |
//!       v                                            |
//! its spheres, eight at a time ---- one meets: a hit |       link, field_lookup, clearance::eight_points
//!       |     |                                      |
//!       |     +-- a part of the field is not made ---+       field_lookup notes it, planner makes it, and the motion
//!       |                                                    is answered again; not in the last round
//!       | the field does not decide
//!       v
//! exactly, one by one ---- one meets: a hit                  found_spheres, field_lookup, clearance::small_balls, and
//!       |                                                    where that does not say, clearance::cube_search
//!       v
//! its points: clumps, eights, voxels ---- a hit              points, field_lookup
//!       |
//!       v
//! clear by the bounds of the field: steps are skipped        motions
//!       |
//!       v   after the last link of the last segment
//! the least clearance, where it is asked for                 motions, link, field_lookup, clearance::cube_search
//!       |
//!       v   after the last round
//! keep-outs along the whole way, where there are some        motions, keep_outs::motions
//!       |
//!       v
//! MotionAnswer
//! ```
//!
//! After a hit the other links of the segment are looked at up to its step, and the segments behind it not at all.
//!
//! Poses go through the same files from the ball on. Whether they meet a voxel is answered in the stages of `pipeline`,
//! so that what the next two answers read of the field is fetched while one is given: bodies of one link at eight
//! configurations at once (`single_link`), others at one after the other (`configuration`).
//!
//! ```text
//! begin    finds the balls around the links in the field           field_lookup
//! go_on    reads these, and finds the spheres of links near voxels  found_spheres
//! end      reads these, then what is open exactly, then the points  found_spheres, points
//! ```
//!
//! First hits and clearances (`answer_kind`) and groups of spheres are answered configuration by configuration, without
//! stages.

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
