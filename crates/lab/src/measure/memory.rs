//! Measurement of the memory that a map takes, part by part.

use crate::workload::{Scan, Workload};
use mrol_map::geometry::Pose;
use mrol_map::map::{
    MapDescription, MapSettings, MapSettingsError, MappedScan, MultiResolutionMap, RobotName, ScanRecord,
};
use mrol_map::voxel::{BlockMask, MomentSet};

/// Bytes of the parts of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts {
    /// Number of finest voxels.
    pub voxels: usize,
    /// Masks of all tiers' blocks, in the exact set.
    pub masks: usize,
    /// The rest of the exact set: slots of its tables, which have room to grow, and clusters.
    pub tables: usize,
    /// Planes and counters of all levels' filters.
    pub filters: usize,
    /// Moments of points.
    pub moments: usize,
}

impl Parts {
    /// The parts of `map`.
    pub fn of(map: &MultiResolutionMap) -> Self {
        let MapDescription { levels, set_bytes, moment_bytes, .. } = map.describe(0, 0);
        let tiers = (0..map.settings().levels).step_by(mrol_map::voxel::BLOCK_LEVELS as usize);
        let view = map.view();
        let blocks: usize = tiers.flat_map(|level| view.lists(level)).map(|list| list.blocks().len()).sum();
        let masks = blocks * BlockMask::BYTES;
        Self {
            voxels: levels.first().map_or(0, |level| level.voxels),
            masks,
            tables: set_bytes.saturating_sub(masks),
            filters: levels.iter().filter_map(|level| level.filter).map(|filter| filter.bytes()).sum(),
            moments: moment_bytes,
        }
    }

    /// Bytes of all parts.
    pub fn total(&self) -> usize {
        self.masks + self.tables + self.filters + self.moments
    }
}

/// The parts of the map of a workload, whose voxels' centers are its points.
///
/// # Errors
/// When a setting is out of range.
pub fn of_workload(workload: Workload, settings: MapSettings) -> Result<Parts, MapSettingsError> {
    let map = MultiResolutionMap::new(settings)?;
    for voxels in workload.pieces() {
        let Some(pose) = pose(Pose::identity()) else { break };
        let moments = if settings.moments { MomentSet::of_centers(&voxels) } else { MomentSet::default() };
        map.committer().insert_scan(ScanRecord { moments, ..ScanRecord::of_voxels(pose, voxels) });
    }
    Ok(Parts::of(&map))
}

/// The parts of the map of scans at their known poses.
///
/// # Errors
/// When a setting is out of range.
pub fn of_scans(scans: &[Scan], settings: MapSettings) -> Result<Parts, MapSettingsError> {
    let map = MultiResolutionMap::new(settings)?;
    for scan in scans {
        let Some(pose) = scan.map_from_sensor.and_then(pose) else { break };
        let record = match settings.moments {
            true => ScanRecord::of_points(pose, &scan.points, map.lattice()),
            false => ScanRecord::without_moments(pose, &scan.points, map.lattice()),
        };
        map.committer().insert_scan(record);
    }
    Ok(Parts::of(&map))
}

fn pose(map_from_sensor: Pose) -> Option<MappedScan> {
    Some(MappedScan::new(RobotName::new("bench").ok()?, map_from_sensor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::Room;

    #[test]
    fn a_query_only_map_takes_its_exact_set_alone_which_is_that_of_the_whole_map() {
        let room = Workload::Room(Room);
        let whole = of_workload(room, MapSettings::new(Room::RESOLUTION_M, 6)).unwrap();
        let lean = of_workload(room, MapSettings::query_only(Room::RESOLUTION_M, 6)).unwrap();
        assert_eq!(lean, Parts { filters: 0, moments: 0, ..whole });
        assert!(whole.filters > whole.voxels && whole.moments > whole.voxels);
        assert!(lean.total() == lean.masks + lean.tables && lean.masks > lean.voxels / 2, "{lean:?}");
    }
}
