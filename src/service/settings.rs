//! What a service is opened with.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::{Gauges, Limits, Observer};
use crate::align::AlignmentSettings;
use crate::bloom::FilterSettings;
use crate::map::RobotName;
use crate::mapping::StationarySettings;
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
    /// Observers, which are told of every operation when it is over.
    pub observers: Vec<Arc<dyn Observer>>,
    /// Threads for queries; 0 = one a core.
    pub query_threads: usize,
    /// Threads for insertions and deletions; 0 = one a core.
    pub mapping_threads: usize,
    /// Threads for alignments of scans that are not inserted; 0 = one a core.
    pub alignment_threads: usize,
    /// Threads for searches with no guess; 0 = one a core.
    pub localization_threads: usize,
    /// Settings of every alignment.
    pub alignment: AlignmentSettings,
    /// When a robot counts as standing still.
    pub stationary: StationarySettings,
    /// Which points of whose scans count; the name `*` stands for every other robot.
    pub robots: BTreeMap<String, PointFilter>,
    /// Filter settings of maps whose makers do not say.
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
