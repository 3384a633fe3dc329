//! What a service is opened with.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use super::cluster::Cluster;
use super::limits::Limits;
use super::observer::Observer;
use super::request::ScanRequest;
use super::resources::Gauges;
use mrol_map::align::AlignmentSettings;
use mrol_map::bloom::FilterSettings;
use mrol_map::map::RobotName;
use mrol_map::mapping::{CarvingSettings, OdometrySettings, SensorMount, StationarySettings};
use mrol_map::scan::PointFilter;
use mrol_map::visibility::SensorModel;
use mrol_store::StoreSettings;

/// Settings of a [`MapService`](crate::MapService).
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
    /// Threads for planners' questions while robots insert scans, and for a second after; 0 = half of those for
    /// queries. Otherwise as many as for queries.
    pub planning_threads_beside_robots: usize,
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
    /// Settings of robots by name; the name `*` stands for every robot without an entry.
    pub robots: BTreeMap<String, RobotSettings>,
    /// Filter settings of maps whose makers do not say.
    pub filter: FilterSettings,
    /// Time after which a map that nobody uses leaves memory; never where none.
    pub sleep_after: Option<Duration>,
    /// The other nodes of the cluster that this server is a node of; none of a server by itself.
    pub cluster: Option<Cluster>,
    /// What the folder is opened for, where no server or node is to serve it.
    pub adoption: Option<Adoption>,
}

/// Whose data folder is opened for a cluster to adopt its maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Adoption {
    /// That of a server by itself; or one of which a cluster has adopted maps before, and which no node has opened
    /// since.
    OfServer,
    /// That of a node too, whose cluster lost what NATS had of it.
    OfNode,
}

/// Settings of a robot, where its requests do not say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RobotSettings {
    /// Which points of its scans count.
    pub filter: PointFilter,
    /// Look for it where its scans are refused: from other guesses, then by a search with no guess around its last good
    /// pose, which two scans have to confirm.
    pub recover: bool,
    /// Take out of the map what its scans saw through.
    pub carve: bool,
    /// How much is believed of what they saw through.
    pub carving: CarvingSettings,
    /// How far off its odometry is.
    pub odometry: OdometrySettings,
    /// How its sensor is mounted.
    pub mount: SensorMount,
    /// How the rays of its sensor lie; of an unknown one it is found out scan by scan.
    pub sensor: Option<SensorModel>,
}

/// The key of [`ServiceSettings::robots`] that stands for every robot without an entry.
pub const EVERY_ROBOT: &str = "*";

impl ServiceSettings {
    /// The settings of a robot.
    pub(super) fn of_robot(&self, robot: &RobotName) -> RobotSettings {
        let settings = self.robots.get(robot.as_str()).or_else(|| self.robots.get(EVERY_ROBOT));
        settings.copied().unwrap_or_default()
    }

    /// True where the robot of a scan is to be looked for if the scan is refused.
    pub(super) fn recovers(&self, scan: &ScanRequest) -> bool {
        scan.recover.unwrap_or_else(|| self.of_robot(&scan.robot).recover)
    }

    /// What a scan carves; none where it does not.
    pub(super) fn carving(&self, scan: &ScanRequest) -> Option<CarvingSettings> {
        let RobotSettings { carve, carving, .. } = self.of_robot(&scan.robot);
        scan.carve.unwrap_or(carve).then_some(carving)
    }
}
