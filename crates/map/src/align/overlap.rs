//! The objective of alignment: how many points of a scan fall in occupied voxels (paper III-B).

use crate::geometry::{Point, Pose};
use crate::map::{Lookup, MultiResolutionMap};
use crate::util::StopSignal;
use crate::voxel::Lattice;

/// A set of occupied voxels at several levels that alignment by overlap can climb on: a map, or a structure that is
/// compared with it.
pub trait OccupiedVoxels: std::fmt::Debug {
    /// The lattices of the levels.
    fn lattice(&self) -> &Lattice;

    /// Number of `points` in occupied voxels of `level`, for each of `poses` (map_from_points).
    fn hits(&self, points: &[Point], poses: &[Pose], level: u32, lookup: Lookup) -> Vec<usize>;
}

/// Look-ups made while the locks are held once: well below a millisecond, so that a committer never waits long.
const LOOKUPS_PER_LOCK: usize = 50_000;

impl OccupiedVoxels for MultiResolutionMap {
    fn lattice(&self) -> &Lattice {
        self.lattice()
    }

    fn hits(&self, points: &[Point], poses: &[Pose], level: u32, lookup: Lookup) -> Vec<usize> {
        let poses_per_lock = (LOOKUPS_PER_LOCK / points.len().max(1)).max(1);
        let hits = poses.chunks(poses_per_lock).flat_map(|poses| {
            let _long_read = (points.len() > LOOKUPS_PER_LOCK).then(|| self.long_read());
            let view = self.view();
            let count = |pose| view.count(points, &self.lattice().from_points(pose), level, lookup);
            poses.iter().map(count).collect::<Vec<_>>()
        });
        hits.collect()
    }
}

/// Look-ups between two checks of the stop signal: a few milliseconds where every one misses all caches.
pub(super) const LOOKUPS_PER_STOP_CHECK: usize = 1 << 18;

/// The objective function of the ascent: the overlap of some points with one level of a map, as a function of their
/// pose.
#[derive(Debug, Clone)]
pub(super) struct Overlap<'a> {
    voxels: &'a dyn OccupiedVoxels,
    points: &'a [Point],
    level: u32,
    lookup: Lookup,
}

impl<'a> Overlap<'a> {
    /// The overlap of `points` (sensor frame) with one level of `map`.
    pub(super) fn new(
        voxels: &'a dyn OccupiedVoxels,
        points: &'a [Point],
        level: u32,
        lookup: Lookup,
    ) -> Self {
        Self { voxels, points, level, lookup }
    }

    /// For each of `poses` (map_from_sensor), the number of points whose voxel is occupied. Once stopped, the numbers
    /// are too small.
    pub(super) fn at(&self, poses: &[Pose], stop: StopSignal<'_>) -> Vec<usize> {
        let mut heights = vec![0; poses.len()];
        let poses_per_look = (LOOKUPS_PER_STOP_CHECK / self.points.len().max(1)).max(1);
        'scan: for (poses, heights) in poses.chunks(poses_per_look).zip(heights.chunks_mut(poses_per_look)) {
            for points in self.points.chunks(LOOKUPS_PER_STOP_CHECK) {
                if stop.is_stopped() {
                    break 'scan;
                }
                let hits = self.voxels.hits(points, poses, self.level, self.lookup);
                heights.iter_mut().zip(hits).for_each(|(sum, hits)| *sum += hits);
            }
        }
        heights
    }

    /// Number of look-ups that evaluating one pose takes.
    pub(super) fn lookups(&self) -> u64 {
        self.points.len() as u64
    }
}

/// Fraction of `points` (sensor frame) in occupied voxels of `level`, exactly, with the sensor at
/// `map_from_sensor`. 0 without points.
pub fn overlap(map: &MultiResolutionMap, points: &[Point], map_from_sensor: &Pose, level: u32) -> f64 {
    overlap_until(map, points, map_from_sensor, level, StopSignal::NEVER)
}

fn overlap_until(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    level: u32,
    stop: StopSignal<'_>,
) -> f64 {
    let overlap = Overlap::new(map, points, level, Lookup::Exact);
    let hits = overlap.at(std::slice::from_ref(map_from_sensor), stop);
    hits[0] as f64 / points.len().max(1) as f64
}

/// The [`overlap`] at every level, finest first.
pub fn level_overlaps(map: &MultiResolutionMap, points: &[Point], map_from_sensor: &Pose) -> Vec<f64> {
    level_overlaps_until(map, points, map_from_sensor, StopSignal::NEVER)
}

/// [`level_overlaps`] under a stop signal. Once `stop` is set, the result is meaningless.
pub(super) fn level_overlaps_until(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    stop: StopSignal<'_>,
) -> Vec<f64> {
    let levels = 0..map.settings().levels;
    levels.map(|level| overlap_until(map, points, map_from_sensor, level, stop)).collect()
}
