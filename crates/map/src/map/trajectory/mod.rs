//! The poses from which a map was seen (paper III-B: the map is stored along with the trajectory).
//!
//! ```text
//! poses    chunk  chunk  chunk ...      all robots, by revision, 256 poses a chunk
//! robots   r1 -> revisions; session -> (ids -> revisions, ranges of the ids of thinned scans)
//!          r2 -> ...
//! marked   poses that were taken out again and are still in their chunks
//! ```
//!
//! All of it is behind shared pointers: a clone takes no time, and readers work on one without a lock. A change copies
//! what it changes: a chunk, where somebody holds a clone, and nothing where nobody does. Undo marks poses; they go
//! when their chunks are thinned (see [`TrajectorySpacing`] and [`Trajectory::thin`]).
//!
//! A pose with its indices takes 256 bytes, as `tests/map/trajectory_growth.rs` measures. A week of eight robots at 10
//! Hz is 48 million scans: thinned, 80,640 poses of one a minute, or 18 MB, and one a place and direction of each
//! robot.

mod chunked;
mod id_ranges;
mod known_scan;
mod map_trajectory;
mod robot_scans;
mod scan;
mod session;
#[cfg(test)]
mod tests;
mod thinning;

pub use id_ranges::ID_RANGES_PER_SESSION_MAX;
pub use known_scan::{ForgottenIds, KnownScan};
pub use map_trajectory::Trajectory;
pub use robot_scans::SESSIONS_PER_ROBOT_MAX;
pub use scan::{MappedScan, OverlapOfNoLevel, ScanRecord, ViewpointRecord, WithdrawnChange};
pub use thinning::{KeptPoses, TrajectorySpacing};
