//! Experiment on mapping: maps that grow scan by scan, timed (paper IV-C).

use std::time::Instant;

use crate::rivals::HashTables;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MappedScan, MultiResolutionMap, RobotName, ScanRecord};

/// A map of any structure that points can be added to.
pub trait GrowingMap {
    /// Adds the voxels of `points`.
    fn insert(&mut self, points: &[Point], map_from_points: &Pose);

    /// Number of finest occupied voxels.
    fn voxels(&self) -> usize;
}

/// The map of this crate, as a robot called `bench` maps with it.
#[derive(Debug)]
pub struct OwnMap {
    /// The map: voxels, their filters and the moments of their points.
    pub map: MultiResolutionMap,
    /// Robot that the scans belong to.
    pub robot: RobotName,
}

impl GrowingMap for OwnMap {
    fn insert(&mut self, points: &[Point], map_from_points: &Pose) {
        let pose = MappedScan::new(self.robot.clone(), *map_from_points);
        self.map.committer().insert_scan(ScanRecord::of_points(pose, points, self.map.lattice()));
    }

    fn voxels(&self) -> usize {
        self.map.voxels(0)
    }
}

impl GrowingMap for HashTables {
    fn insert(&mut self, points: &[Point], map_from_points: &Pose) {
        Self::insert(self, points, map_from_points);
    }

    fn voxels(&self) -> usize {
        self.voxels(0)
    }
}

/// A map that is being built, with the pose of its last scan.
#[derive(Debug)]
pub struct Mapping<M> {
    map: M,
    last: Pose,
}

/// Result of mapping one scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mapped {
    /// Pose that was found, map_from_sensor.
    pub map_from_sensor: Pose,
    /// Duration of the alignment, milliseconds.
    pub align_ms: f64,
    /// Duration of the insertion, milliseconds.
    pub update_ms: f64,
    /// Number of finest occupied voxels after the insertion.
    pub voxels: usize,
}

impl<M: GrowingMap> Mapping<M> {
    /// Starts with `map`, before the first scan, which will be at the origin.
    pub fn new(map: M) -> Self {
        Self { map, last: Pose::identity() }
    }

    /// Returns the map as it is now.
    pub fn map(&self) -> &M {
        &self.map
    }

    /// Adds `points` (sensor frame, finite) where `find(map, points, guess)` finds them; the guess is the last pose, as
    /// in the paper.
    pub fn add(&mut self, points: &[Point], find: impl FnOnce(&M, &[Point], &Pose) -> Pose) -> Mapped {
        let start = Instant::now();
        if self.map.voxels() > 0 {
            self.last = find(&self.map, points, &self.last);
        }
        let align_ms = start.elapsed().as_secs_f64() * 1e3;

        let start = Instant::now();
        self.map.insert(points, &self.last);
        let update_ms = start.elapsed().as_secs_f64() * 1e3;
        Mapped { map_from_sensor: self.last, align_ms, update_ms, voxels: self.map.voxels() }
    }
}
