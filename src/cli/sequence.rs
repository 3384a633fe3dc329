//! Scans with the poses where they were taken, from files or simulated.

use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::error::CliError;
use super::output::Output;
use super::truth::true_poses;
use crate::bench::align::Scan;
use crate::geometry::Point;
use crate::scan::{ReadError, Scene, Tour, read_points, scan_files};

/// The finite points of each scan file in `paths`, `scans_max` of them at most, with its true pose where `truth` is
/// given.
pub(super) fn read(
    paths: &[PathBuf],
    truth: Option<&Path>,
    scans_max: usize,
    output: &Output,
) -> Result<Vec<Scan>, CliError> {
    let mut files = scan_files(paths)?;
    files.truncate(scans_max);
    let poses = truth.map(|path| true_poses(path, files.len(), output)).transpose()?;
    let read = |(k, file): (usize, &PathBuf)| {
        let map_from_sensor = poses.as_ref().map(|poses| poses[k]);
        Ok(Scan { points: finite_points(file)?, map_from_sensor })
    };
    files.iter().enumerate().map(read).collect()
}

/// What the sensor of `tour` sees in the furnished building of `seed`.
pub(super) fn simulate(tour: &Tour, seed: u64) -> Vec<Scan> {
    let (scene, mut random) = (Scene::furnished(seed), ChaCha8Rng::seed_from_u64(seed));
    let scan = |pose| Scan {
        points: finite(tour.sensor.scan(&scene, pose, &mut random)),
        map_from_sensor: Some(*pose),
    };
    tour.poses.iter().map(scan).collect()
}

/// The points of a scan file that are somewhere.
pub(super) fn finite_points(file: &Path) -> Result<Vec<Point>, ReadError> {
    Ok(finite(read_points(file)?))
}

fn finite(mut points: Vec<Point>) -> Vec<Point> {
    points.retain(|point| point.is_finite());
    points
}
