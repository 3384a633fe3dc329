//! Undo, and its answers.

use super::version::MapVersion;
use mrol_map::map::{RequestId, RobotName, SessionName};

/// Which changes to take back.
#[derive(Debug, Clone)]
pub struct Undo {
    /// Which.
    pub target: UndoTarget,
    /// The caller's own id of this undo; makes it idempotent.
    pub request_id: Option<RequestId>,
}

/// The ways to name accepted scans, and deletions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UndoTarget {
    /// A scan, by the robot's own number.
    Scan {
        /// The robot that sent the scan.
        robot: RobotName,
        /// The session in which it did.
        session: SessionName,
        /// The scan's number.
        scan_id: u64,
    },
    /// A scan or a deletion, by the revision that it made.
    Revision(u64),
    /// All of a robot's scans that made a revision after this one.
    RobotSince {
        /// The robot that sent the scans.
        robot: RobotName,
        /// The last revision to keep.
        revision: u64,
    },
}

/// What an undo did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UndoAnswer {
    /// Scans taken back.
    pub scans: usize,
    /// Deletions taken back.
    pub deletions: usize,
    /// Finest voxels that went: no other scan holds them.
    pub removed: usize,
    /// Finest voxels that came back.
    pub restored: usize,
    /// After it.
    pub version: MapVersion,
    /// True of an undo that was done before under its id: this is that answer.
    pub replayed: bool,
}
