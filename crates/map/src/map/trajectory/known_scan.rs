//! What a trajectory knows of scans by their ids, those among them whose poses are not stored.

use super::scan::MappedScan;
use crate::map::name::SessionName;

/// What a map knows of a scan by its robot, session and id.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KnownScan<'a> {
    /// It was accepted and is in the map.
    Kept(&'a MappedScan),
    /// It was accepted, and an undo took it out of the map.
    Undone(&'a MappedScan),
    /// It was accepted, or may have been, so long ago that its pose is not stored.
    TooOld,
}

/// Ids of a robot's scans whose poses are not stored any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForgottenIds<'a> {
    /// The session whose ids they are. None: `ranges` are digests of the names of closed sessions, all of whose ids are
    /// too old.
    pub session: Option<&'a SessionName>,
    /// The ids as ascending ranges, both ends within.
    pub ranges: &'a [(u64, u64)],
    /// The last revision that a scan of the session made; 0 of the empty session, which is never closed.
    pub last_revision: u64,
}
