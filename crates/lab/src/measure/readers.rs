//! Measurement of concurrency: readers of one map at once, and beside a writer.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::rivals::{Structure, ThroughMap};
use crate::workload::{Queries, add};
use mrol_map::map::{Lookup, MultiResolutionMap};
use mrol_map::voxel::VoxelSet;

/// Readers and writers that use the map at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crowd {
    /// Number of reading threads.
    pub readers: usize,
    /// Whether a thread changes the map all the time: removes a scan and inserts it again.
    pub writer: bool,
}

/// Throughput of a crowd.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Throughput {
    /// Points answered per second, over all readers.
    pub points_per_s: f64,
    /// Changes of the writer per second.
    pub commits_per_s: f64,
}

/// Number of points of a scan of the writer.
const SCAN_POINTS: usize = 30_000;

/// Lets a crowd use `map` for `time`. Readers query all points repeatedly, ten thousand at a time; the writer changes
/// the voxels of the same points.
pub fn run(
    map: &MultiResolutionMap,
    queries: &Queries,
    lookup: Lookup,
    crowd: Crowd,
    time: Duration,
) -> Throughput {
    let (over, answered, commits) = (AtomicBool::new(false), AtomicUsize::new(0), AtomicUsize::new(0));
    let start = Instant::now();
    std::thread::scope(|threads| {
        for _ in 0..crowd.readers {
            threads.spawn(|| read(&ThroughMap::new(map, 0, lookup), queries, &over, &answered));
        }
        if crowd.writer {
            threads.spawn(|| write(map, queries, &over, &commits));
        }
        std::thread::sleep(time);
        over.store(true, Ordering::Relaxed);
    });
    let seconds = start.elapsed().as_secs_f64();
    let rate = |count: AtomicUsize| count.into_inner() as f64 / seconds;
    Throughput { points_per_s: rate(answered), commits_per_s: rate(commits) }
}

/// Number of points between two looks of a reader at the clock: about a tenth of a millisecond.
const CALL_POINTS: usize = 40_960;

fn read(map: &ThroughMap<'_>, queries: &Queries, over: &AtomicBool, answered: &AtomicUsize) {
    let mut occupied = [0; CALL_POINTS.div_ceil(64)];
    for points in queries.points.chunks(CALL_POINTS).cycle() {
        map.occupied(points, &queries.map_from_points, &mut occupied[..points.len().div_ceil(64)]);
        answered.fetch_add(points.len(), Ordering::Relaxed);
        // Checked at the end, so that on a busy machine each reader is answered once.
        if over.load(Ordering::Relaxed) {
            return;
        }
    }
}

fn write(map: &MultiResolutionMap, queries: &Queries, over: &AtomicBool, commits: &AtomicUsize) {
    let quantize = map.lattice().from_points(&queries.map_from_points);
    for scan in queries.points.chunks(SCAN_POINTS).cycle() {
        let present = present(map, &VoxelSet::of_points(scan, &quantize).0);
        map.committer().remove(&present);
        add(map, present);
        commits.fetch_add(2, Ordering::Relaxed);
        if over.load(Ordering::Relaxed) {
            return;
        }
    }
}

/// The voxels of `voxels` that are in the map.
fn present(map: &MultiResolutionMap, voxels: &VoxelSet) -> VoxelSet {
    let view = map.view();
    voxels.iter().filter(|&voxel| view.contains(voxel, 0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Room, Workload};
    use mrol_map::map::MapSettings;

    #[test]
    fn readers_are_answered_beside_a_writer_that_leaves_the_map_as_it_was() {
        let map = Workload::Room(Room).map(MapSettings::new(0.05, 4)).unwrap();
        let (voxels, queries) = (map.voxels(0), Workload::Room(Room).queries(Order::Scan, 60_000, 1));
        let crowd = Crowd { readers: 2, writer: true };
        let done = run(&map, &queries, Lookup::Bloom, crowd, Duration::from_millis(50));
        assert!(done.points_per_s > 0.0 && done.commits_per_s > 0.0);
        assert_eq!(map.voxels(0), voxels);
    }
}
