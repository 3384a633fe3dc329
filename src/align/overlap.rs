//! The objective of alignment: how many points of a scan fall in occupied voxels (paper III-B).

use std::ops::RangeInclusive;

use crate::geometry::{Point, Pose};
use crate::map::{Lookup, MultiResolutionMap};

/// The overlap of some points with one or more levels of a map, as a function of their pose.
#[derive(Debug, Clone)]
pub(super) struct Overlap<'a> {
    map: &'a MultiResolutionMap,
    points: &'a [Point],
    levels: RangeInclusive<u32>,
    lookup: Lookup,
}

/// Look-ups made under one set of locks: well below a millisecond, so that a committer never waits long.
const LOOKUPS_PER_LOCK: usize = 50_000;

impl<'a> Overlap<'a> {
    /// At one level.
    pub(super) fn new(map: &'a MultiResolutionMap, points: &'a [Point], level: u32, lookup: Lookup) -> Self {
        Self { map, points, levels: level..=level, lookup }
    }

    /// At all levels, summed: a level counts twice as much as the next coarser one (paper \[9\]).
    pub(super) fn weighted_sum(map: &'a MultiResolutionMap, points: &'a [Point], lookup: Lookup) -> Self {
        Self { map, points, levels: 0..=map.settings().levels - 1, lookup }
    }

    /// Points whose voxel is occupied, for each candidate pose.
    pub(super) fn at(&self, poses: &[Pose]) -> Vec<usize> {
        let poses_per_lock = (LOOKUPS_PER_LOCK / self.points.len().max(1)).max(1);
        let counts = poses.chunks(poses_per_lock).flat_map(|poses| {
            let view = self.map.view();
            let count = |pose: &Pose| {
                let quantise = self.map.lattice().from_points(pose);
                let hits = |level: u32| {
                    view.count(self.points, &quantise, level, self.lookup) << (self.levels.end() - level)
                };
                self.levels.clone().map(hits).sum::<usize>()
            };
            poses.iter().map(count).collect::<Vec<_>>()
        });
        counts.collect()
    }

    /// Look-ups that one pose costs.
    pub(super) fn lookups(&self) -> u64 {
        self.points.len() as u64 * self.levels.clone().count() as u64
    }
}

/// Fraction of `points` (sensor frame) in occupied voxels of `level`, exactly, with the sensor at
/// `map_from_sensor`. 0 without points.
pub fn overlap(map: &MultiResolutionMap, points: &[Point], map_from_sensor: &Pose, level: u32) -> f64 {
    let hits = Overlap::new(map, points, level, Lookup::Exact).at(std::slice::from_ref(map_from_sensor));
    hits[0] as f64 / points.len().max(1) as f64
}

/// The [`overlap`] at every level, finest first.
pub fn level_overlaps(map: &MultiResolutionMap, points: &[Point], map_from_sensor: &Pose) -> Vec<f64> {
    (0..map.settings().levels).map(|level| overlap(map, points, map_from_sensor, level)).collect()
}
