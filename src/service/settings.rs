//! What a service is opened with.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::{Gauges, Limits};
use crate::align::AlignmentSettings;
use crate::bloom::FilterSettings;
use crate::map::RobotName;
use crate::scan::PointFilter;
use crate::store::StoreSettings;

/// Settings of a [`super::MapService`].
#[derive(Debug, Clone, Default)]
pub struct ServiceSettings {
    /// Where maps are kept across restarts; nowhere without.
    pub data_dir: Option<PathBuf>,
    /// How they are kept there.
    pub store: StoreSettings,
    /// Bounds on what callers may ask.
    pub limits: Limits,
    /// What disk and memory are measured with; without, nothing is refused for want of them.
    pub gauges: Option<Arc<dyn Gauges>>,
    /// Threads for queries; 0 = one a core.
    pub query_threads: usize,
    /// Threads for insertions and deletions; 0 = one a core.
    pub mapping_threads: usize,
    /// Threads for alignments of scans that are not inserted; 0 = one a core.
    pub alignment_threads: usize,
    /// Threads for searches with no guess; 0 = one a core.
    pub localization_threads: usize,
    /// Of every alignment.
    pub alignment: AlignmentSettings,
    /// When a robot counts as standing.
    pub standing: StandingSettings,
    /// Which points of whose scans count; the name `*` stands for every other robot.
    pub robots: BTreeMap<String, PointFilter>,
    /// Of maps whose makers do not say.
    pub filter: FilterSettings,
}

/// The key of [`ServiceSettings::robots`] that stands for every robot without an entry.
pub const EVERY_ROBOT: &str = "*";

impl ServiceSettings {
    /// Which points of a robot's scans count.
    pub(super) fn filter_of(&self, robot: &RobotName) -> PointFilter {
        let filter = self.robots.get(robot.as_str()).or_else(|| self.robots.get(EVERY_ROBOT));
        filter.copied().unwrap_or_default()
    }
}

/// When an aligned scan is of a robot that stands still with its view known already. It is accepted and not kept, so that
/// a robot that sends scan after scan from its dock does not grow trajectory and storage without bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandingSettings {
    /// At most this far from the robot's last pose, as a fraction of r_0. 0.5.
    pub distance: f64,
    /// At most this much turned against it, degrees. 0.5.
    pub rotation_deg: f64,
    /// At most this fraction of the scan's voxels is new. 0.001: noise puts a few points next to a surface, a cup on a
    /// table is more.
    pub new_voxels: f64,
}

impl Default for StandingSettings {
    fn default() -> Self {
        Self { distance: 0.5, rotation_deg: 0.5, new_voxels: 0.001 }
    }
}
