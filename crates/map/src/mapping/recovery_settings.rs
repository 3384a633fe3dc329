//! Settings of recovery.

use std::time::Duration;

use super::lost_robots::LostRobots;
use crate::align::localize::LocalizationSettings;

/// When and how a lost robot is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecoverySettings {
    /// Approximate number of points that are kept of a refused scan. 20,000.
    pub points_kept: usize,
    /// A scan is where its motion since the scan before it leads if it is found within so many r_0 of that. 6.
    pub agreement: f64,
    /// And turned by no more than this, degrees. 5.
    pub agreement_deg: f64,
    /// How a robot is searched for of which nothing is known, and what a place has to fulfill.
    pub localization: LocalizationSettings,
    /// How far from its last good pose a robot is looked for at least, meters. 20.
    pub distance_min_m: f64,
    /// How fast the distance grows in which it is looked for, with the time since its last good pose, meters a second.
    /// 5. Where scans have no timestamps, the whole map is searched.
    pub speed_max_m_per_s: f64,
    /// The first search takes the sensor to be as upright as at its last good pose, which bounds a third of the cells.
    /// True.
    pub keeps_tilt: bool,
    /// Shortest time between two searches for the same robot. 0.
    pub search_interval: Duration,
}

impl Default for RecoverySettings {
    fn default() -> Self {
        Self {
            points_kept: 20_000,
            agreement: 6.0,
            agreement_deg: 5.0,
            localization: LocalizationSettings::default(),
            distance_min_m: 20.0,
            speed_max_m_per_s: 5.0,
            keeps_tilt: true,
            search_interval: Duration::ZERO,
        }
    }
}

/// Kinds of searches, one after the other: with the last good tilt, and with all orientations.
pub(super) const KINDS_OF_SEARCH: u64 = 2;
/// Finest search voxels within a scan's range in these searches: fewer than where a caller asks for one. With 28 about
/// as many real scans are found, and up to four times as many cells are bounded.
const RESOLUTIONS_PER_RANGE: f64 = 20.0;

impl RecoverySettings {
    /// How a robot is searched for.
    pub(super) fn search(&self) -> LocalizationSettings {
        LocalizationSettings { resolutions_per_range: RESOLUTIONS_PER_RANGE, ..self.localization }
    }

    /// True of a search that takes the sensor to be as upright as it was, the `number`th (from 1).
    pub(super) fn keeps_tilt_in(&self, number: u64) -> bool {
        self.keeps_tilt && !number.is_multiple_of(KINDS_OF_SEARCH)
    }
}

/// Lost robots, and how they are looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recovery<'a> {
    pub(super) lost: &'a LostRobots,
    pub(super) settings: RecoverySettings,
}
