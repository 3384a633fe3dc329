//! Measurement of insertion and removal.

use super::stopwatch::Runs;
use crate::workload::{Queries, add};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapDescription, MapSettings, MapSettingsError, MultiResolutionMap};
use mrol_map::voxel::quantize;
use mrol_map::voxel::{Lattice, VoxelSet};

/// Durations of insertion, nanoseconds a point, run by run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inserted {
    /// Insertion of points in voxels that were not in the map.
    pub new: Runs,
    /// Insertion of points in voxels that were in the map.
    pub known: Runs,
    /// Number of voxels afterwards.
    pub voxels: usize,
    /// Bytes of memory afterwards.
    pub bytes: usize,
}

/// Inserts points at their known pose into an empty map, and then again, scan by scan of `scan_points` points,
/// `repeats` times: quantize, group, and commit to all levels and filters. Each point should lie in a voxel of its
/// own.
///
/// # Errors
/// When a setting is out of range.
pub fn into_map(
    settings: MapSettings,
    points: &Queries,
    scan_points: usize,
    repeats: usize,
) -> Result<Inserted, MapSettingsError> {
    let mut inserted = Inserted::default();
    for _ in 0..repeats {
        let map = MultiResolutionMap::new(settings)?;
        inserted.new.time(points.points.len(), || insert(&map, points, scan_points));
        inserted.known.time(points.points.len(), || insert(&map, points, scan_points));
        (inserted.voxels, inserted.bytes) = (map.voxels(0), bytes(&map));
    }
    Ok(inserted)
}

fn insert(map: &MultiResolutionMap, points: &Queries, scan_points: usize) {
    let quantize = map.lattice().from_points(&points.map_from_points);
    for scan in points.points.chunks(scan_points) {
        add(map, VoxelSet::of_points(scan, &quantize).0);
    }
}

/// Bytes of a map's sets and filters, of all levels.
pub fn bytes(map: &MultiResolutionMap) -> usize {
    map.describe(0, 0).set_bytes + filter_bytes(map)
}

/// Bytes of a map's filters, of all levels.
pub(super) fn filter_bytes(map: &MultiResolutionMap) -> usize {
    let MapDescription { levels, .. } = map.describe(0, 0);
    levels.iter().filter_map(|level| level.filter).map(|filter| filter.bytes()).sum()
}

/// Times insertion into a hash set of packed keys, which has one level and no filter.
///
/// # Errors
/// When the settings' resolution is out of range.
pub fn into_hash_set(
    settings: MapSettings,
    points: &Queries,
    scan_points: usize,
    repeats: usize,
) -> Result<Inserted, MapSettingsError> {
    let lattice = Lattice::new(settings.resolution_m, 1)?;
    let mut inserted = Inserted::default();
    for _ in 0..repeats {
        let mut set = hashbrown::HashSet::new();
        let mut insert = || {
            let scans = points.points.chunks(scan_points);
            scans.for_each(|scan| insert_keys(&mut set, scan, &lattice, &points.map_from_points));
        };
        inserted.new.time(points.points.len(), &mut insert);
        inserted.known.time(points.points.len(), &mut insert);
        (inserted.voxels, inserted.bytes) = (set.len(), set.allocation_size());
    }
    Ok(inserted)
}

fn insert_keys(set: &mut hashbrown::HashSet<u64>, scan: &[Point], lattice: &Lattice, map_from_points: &Pose) {
    let mut keys = vec![0; scan.len()];
    quantize::keys(scan, &lattice.from_points(map_from_points), 0, &mut keys);
    set.extend(keys.into_iter().filter(|&key| key != quantize::NO_KEY));
}

/// Times the removal of all voxels of `points` from a map that holds them, scan by scan, `repeats` times; nanoseconds a
/// point.
///
/// # Errors
/// When a setting is out of range.
pub fn out_of_map(
    settings: MapSettings,
    points: &Queries,
    scan_points: usize,
    repeats: usize,
) -> Result<Runs, MapSettingsError> {
    let mut runs = Runs::default();
    for _ in 0..repeats {
        let map = MultiResolutionMap::new(settings)?;
        insert(&map, points, scan_points);
        let quantize = map.lattice().from_points(&points.map_from_points);
        runs.time(points.points.len(), || {
            for scan in points.points.chunks(scan_points) {
                map.committer().remove(&VoxelSet::of_points(scan, &quantize).0);
            }
        });
        debug_assert!(map.is_empty());
    }
    Ok(runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Room, Workload};

    #[test]
    fn what_goes_in_is_what_comes_out() {
        let settings = MapSettings::new(0.05, 4);
        let lattice = Lattice::new(0.05, 4).unwrap();
        let points = Workload::Room(Room)
            .queries(Order::Scan, 30_000, 1)
            .first_of_each_voxel(|pose| lattice.from_points(pose), 5000);
        let map = into_map(settings, &points, 1000, 2).unwrap();
        let set = into_hash_set(settings, &points, 1000, 2).unwrap();
        assert_eq!((map.voxels, set.voxels), (5000, 5000));
        assert!(map.bytes > 5000 && set.bytes > 5000 * 8);
        assert_eq!((map.new.ns_per_item().len(), map.known.ns_per_item().len()), (2, 2));
        assert_eq!(out_of_map(settings, &points, 1000, 2).unwrap().ns_per_item().len(), 2);
    }
}
