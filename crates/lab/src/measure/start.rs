//! Measurement of a server's start: a snapshot of a map, and the journal after it.

use std::path::Path;

use uuid::Uuid;

use super::stopwatch::Runs;
use crate::workload::Queries;
use mrol_map::map::{Change, MapName, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol_map::voxel::MomentSet;
use mrol_service::{MapService, ServiceError, ServiceSettings};
use mrol_store::{DataDir, OpeningProgress, Record, Snapshot, StoreError, StoreSettings};

/// Sizes of snapshot and journal in a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kept {
    /// Bytes of the snapshot file.
    pub snapshot_bytes: usize,
    /// Bytes of the journal after the snapshot.
    pub journal_bytes: u64,
    /// Number of records in the journal.
    pub records: u64,
}

/// Fills an empty folder with a snapshot of `map`, and a journal of at least `journal_bytes` after it: scans of
/// `scan_points` of `points`, repeated where they are few.
///
/// # Errors
/// When the system refuses.
pub fn keep(
    folder: &Path,
    map: &MultiResolutionMap,
    points: &Queries,
    scan_points: usize,
    journal_bytes: u64,
) -> Result<Kept, StoreError> {
    let mut snapshot = Snapshot::of(map, Uuid::new_v4());
    // A workload's map has no moments: they are added, as many as in a map that robots made.
    snapshot.contents.moments = MomentSet::of_centers(&snapshot.contents.voxels);
    let snapshot_bytes = snapshot.encode().map_or(0, |bytes| bytes.len());
    let name = MapName::new("bench").map_err(|e| StoreError::damaged(folder, e.to_string()))?;
    let kept = DataDir::open(folder, StoreSettings::default())?.create(&name, &snapshot)?;
    for scan in points.points.chunks(scan_points).cycle() {
        if kept.used().journal.bytes >= journal_bytes {
            break;
        }
        let robot = RobotName::new("bench").map_err(|e| StoreError::damaged(folder, e.to_string()))?;
        let pose = MappedScan::new(robot, points.map_from_points);
        let change = Change::Insertion(ScanRecord::of_points(pose, scan, map.lattice()));
        let record = Record::of(&change).map_err(|e| StoreError::damaged(folder, e))?;
        kept.append(&[&record])?;
    }
    kept.sync()?;
    let journal = kept.used().journal;
    Ok(Kept { snapshot_bytes, journal_bytes: journal.bytes, records: journal.records })
}

/// Times the opening of a service on the folder, `repeats` times, nanoseconds each.
///
/// # Errors
/// When the service cannot be opened.
pub fn open(folder: &Path, repeats: usize) -> Result<Runs, ServiceError> {
    let mut runs = Runs::default();
    for _ in 0..repeats {
        let settings = ServiceSettings { data_dir: Some(folder.to_owned()), ..ServiceSettings::default() };
        runs.time(1, || MapService::open(settings, &OpeningProgress::default()))?;
    }
    Ok(runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Room, Workload};
    use mrol_map::map::MapSettings;

    #[test]
    fn a_folder_holds_the_journal_that_was_asked_for_and_opens() {
        let folder = tempfile::tempdir().unwrap();
        let room = Workload::Room(Room);
        let map = room.map(MapSettings::new(0.05, 4)).unwrap();
        let points = room.queries(Order::Scan, 5000, 1);
        let kept = keep(folder.path(), &map, &points, 1000, 20_000).unwrap();
        assert!(kept.journal_bytes >= 20_000 && kept.records > 1 && kept.snapshot_bytes > 1000);
        assert_eq!(open(folder.path(), 2).unwrap().ns_per_item().len(), 2);
    }
}
