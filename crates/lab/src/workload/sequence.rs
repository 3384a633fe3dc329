//! Sequences of scans, with the poses where they were taken.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use mrol_map::geometry::{Point, Pose};
use mrol_simulate::{Scene, Tour};

/// A scan of a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// The points: finite, sensor frame, meters.
    pub points: Vec<Point>,
    /// Pose of the scan, map_from_sensor, if known.
    pub map_from_sensor: Option<Pose>,
}

impl Scan {
    /// Makes a scan of the finite points.
    pub fn of_finite(mut points: Vec<Point>, map_from_sensor: Option<Pose>) -> Self {
        points.retain(|point| point.is_finite());
        Self { points, map_from_sensor }
    }
}

/// Simulates the scans of `tour` in the furnished building of `seed`.
pub fn simulate(tour: &Tour, seed: u64) -> Vec<Scan> {
    let (scene, mut random) = (Scene::furnished(seed), ChaCha8Rng::seed_from_u64(seed));
    let scan = |pose| Scan::of_finite(tour.sensor.scan(&scene, pose, &mut random), Some(*pose));
    tour.poses.iter().map(scan).collect()
}
