//! Trajectory queries, and their answers.

use super::version::MapVersion;
use mrol_map::map::{MappedScan, RobotName};

/// Which of the accepted scans' poses.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TrajectoryQuery {
    /// Poses of this robot alone; of all robots where none.
    pub robot: Option<RobotName>,
    /// Poses of scans that made a revision after this one.
    pub since_revision: u64,
    /// At most so many; where none, what an answer may hold.
    pub limit: Option<usize>,
}

/// The accepted scans' poses, or the next of them.
#[derive(Debug, Clone)]
pub struct TrajectoryAnswer {
    /// In the order of acceptance.
    pub poses: Vec<MappedScan>,
    /// Ask for those since this revision for the next; none where these are the last.
    pub next_since_revision: Option<u64>,
    /// At this state.
    pub version: MapVersion,
}
