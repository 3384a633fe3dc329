//! Scans that were located, and what became of them.

use std::time::Duration;

use super::recovered::Recovered;
use crate::align::{Alignment, Verdict};
use crate::geometry::{Pose, Twist};
use crate::map::Committed;

/// Where a scan was found to have been taken.
#[derive(Debug, Clone, PartialEq)]
pub struct LocatedScan {
    /// The pose that its guess stood for.
    pub guess: Pose,
    /// The pose, and how well the scan fits the map there.
    pub alignment: Alignment,
    /// How long it took to find it.
    pub align_time: Duration,
    /// The map was empty, so that the scan went to its guess. Whatever inserts it must see to it that the map is still
    /// empty then, or locate it again.
    pub is_first: bool,
    /// The velocity of the sensor that its points were deskewed with; none of points that were measured at once, or
    /// where the velocity is not known.
    pub velocity: Option<Twist>,
    /// How its robot, which was lost, was found again; none of a scan that fits from its own guess, or nowhere.
    pub recovered: Option<Recovered>,
}

impl LocatedScan {
    /// True of a scan that fits the map.
    pub fn is_accepted(&self) -> bool {
        self.alignment.verdict == Verdict::Accepted
    }
}

/// What became of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanOutcome {
    /// Where it was found.
    pub located: LocatedScan,
    /// The change that it made to the map; none of a scan that was refused, or whose robot stands still.
    pub committed: Option<Committed>,
    /// How long recording and inserting it took.
    pub insert_time: Duration,
}

impl ScanOutcome {
    /// True of a scan that is in the map.
    pub fn is_inserted(&self) -> bool {
        self.committed.is_some()
    }
}
