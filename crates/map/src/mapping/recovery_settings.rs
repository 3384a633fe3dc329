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
    /// The first searches take the sensor to be as upright as at its last good pose, which takes a tenth of the time. True.
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

/// Kinds of searches, one after the other: on coarse voxels with the last good tilt, then on fine ones; the same with all orientations.
pub(super) const KINDS_OF_SEARCH: u64 = 4;
/// How much coarser the voxels of the first searches are: so that they take a fifth of the time.
const COARSER: f64 = 2.0;

impl RecoverySettings {
    /// How a robot is searched for, the `number`th time (from 1).
    pub(super) fn search(&self, number: u64) -> LocalizationSettings {
        let is_coarse = number % 2 == 1;
        let all = self.localization;
        let resolutions_per_range = all.resolutions_per_range / if is_coarse { COARSER } else { 1.0 };
        LocalizationSettings { resolutions_per_range, ..all }
    }

    /// True of a search that takes the sensor to be as upright as it was, the `number`th (from 1).
    pub(super) fn keeps_tilt_in(&self, number: u64) -> bool {
        self.keeps_tilt && (number.max(1) - 1) % KINDS_OF_SEARCH < KINDS_OF_SEARCH / 2
    }
}

/// Lost robots, and how they are looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recovery<'a> {
    pub(super) lost: &'a LostRobots,
    pub(super) settings: RecoverySettings,
}
