//! Robots that stand still.

use crate::geometry::{Pose, pose_difference};
use crate::map::{MappedScan, MultiResolutionMap, ScanRecord};

/// When a scan counts as one of a robot that stands still with its view known already. Such a scan is accepted and not
/// kept, so that a robot that sends scan after scan from its dock does not grow trajectory and storage without bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StationarySettings {
    /// Largest distance from the robot's last pose, as a fraction of r_0. 0.5.
    pub distance: f64,
    /// Largest rotation against it, degrees. 0.5.
    pub rotation_deg: f64,
    /// Largest fraction of the scan's voxels that is new. 0.001: noise puts a few points next to a surface, a cup on a
    /// table is more.
    pub new_voxels: f64,
}

impl Default for StationarySettings {
    fn default() -> Self {
        Self { distance: 0.5, rotation_deg: 0.5, new_voxels: 0.001 }
    }
}

impl StationarySettings {
    /// True of a scan that shows again what `last`, its robot's last one that was kept, showed, from where that was
    /// taken.
    pub(super) fn is_stationary(
        &self,
        map: &MultiResolutionMap,
        last: &MappedScan,
        record: &ScanRecord,
    ) -> bool {
        self.is_same_pose(map, &last.map_from_sensor, &record.pose.map_from_sensor)
            && map.view().absent(&record.voxels) as f64 <= self.new_voxels * record.voxels.len() as f64
    }

    /// True of two poses at which a robot stands still between them.
    pub(super) fn is_same_pose(&self, map: &MultiResolutionMap, one: &Pose, other: &Pose) -> bool {
        let (meters, degrees) = pose_difference(one, other);
        meters <= self.distance * map.lattice().resolution_m(0) && degrees <= self.rotation_deg
    }
}
