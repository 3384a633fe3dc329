//! One alignment to a map of some scans, and the errors that guesses have.

use std::time::{Duration, Instant};

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::experiment::convergence::direction;
use mrol_map::align::{Alignment, AlignmentSettings, PoseCovariance, PosePrior, align_until};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol_map::mapping::{
    CarvingSettings, Guess, LocatedScan, MappingSettings, Scan, ScanMapper, Sightings, ViewpointSettings,
};
use mrol_map::util::StopSignal;
use mrol_simulate::{Scene, SpinningLidar, gaussian};

/// Side of a voxel in simulated places, meters.
pub(super) const SIMULATED_M: f64 = 0.1;

/// The random numbers of a seed.
pub fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A pose so many meters and degrees off `truth`, in a uniform direction and about a uniform axis.
pub(super) fn off_by(truth: &Pose, (meters, degrees): (f64, f64), random: &mut ChaCha8Rng) -> Pose {
    let shift = Translation3::from(direction(random) * meters);
    let turn = UnitQuaternion::from_scaled_axis(direction(random) * degrees.to_radians());
    Pose::from_parts(shift * truth.translation, turn * truth.rotation)
}

/// A map of scans at their poses, with the viewpoints that they leave under these settings.
pub(super) fn mapped<'s>(
    scans: impl Iterator<Item = &'s (Vec<Point>, Pose)>,
    resolution_m: f64,
    viewpoints: ViewpointSettings,
) -> Option<MultiResolutionMap> {
    let map = MultiResolutionMap::new(MapSettings::new(resolution_m, 5)).ok()?;
    let (robot, sightings) = (RobotName::new("surveyor").ok()?, Sightings::default());
    let mapper =
        ScanMapper::new(&map, &sightings, MappingSettings { viewpoints, ..MappingSettings::default() });
    for (points, pose) in scans {
        let scan = Scan { guess: Guess::Pose(*pose), at_guess: true, ..Scan::new(&robot, points) };
        mapper.map_scan(&scan, StopSignal::NEVER).ok()?;
    }
    Some(map)
}

pub(super) fn aligned(
    map: &MultiResolutionMap,
    points: &[Point],
    prior: &PosePrior,
    settings: &AlignmentSettings,
) -> (Alignment, Duration) {
    let start = Instant::now();
    let found = align_until(map, points, prior, settings, StopSignal::NEVER);
    (found, start.elapsed())
}

/// How many voxels of the map an accepted scan takes out, where it was found.
pub(super) fn carved(map: &MultiResolutionMap, points: &[Point], alignment: &Alignment) -> Option<usize> {
    let (robot, sightings) = (RobotName::new("surveyor").ok()?, Sightings::default());
    let carving = Some(CarvingSettings::default());
    let mapper = ScanMapper::new(map, &sightings, MappingSettings { carving, ..MappingSettings::default() });
    let located = LocatedScan {
        guess: alignment.map_from_sensor,
        alignment: alignment.clone(),
        align_time: Duration::ZERO,
        is_first: false,
        velocity: None,
        recovered: None,
    };
    let scan = Scan::new(&robot, points);
    let record = mapper.record(&scan, &located, StopSignal::NEVER).ok()?;
    Some(mapper.carve(&scan, &located, &record, StopSignal::NEVER).ok()?.voxels.len())
}

/// A lidar of sixteen rings.
pub(super) fn lidar(range_max_m: f64) -> SpinningLidar {
    SpinningLidar {
        rings: 16,
        azimuths: 720,
        elevation_max_deg: 20.0,
        range_max_m,
        ..SpinningLidar::default()
    }
}

/// A scan's returns.
pub(super) fn seen(lidar: &SpinningLidar, scene: &Scene, pose: &Pose, random: &mut ChaCha8Rng) -> Vec<Point> {
    let is_finite = |point: &Point| point.xyz().iter().all(|c| c.is_finite());
    lidar.scan(scene, pose, random).into_iter().filter(is_finite).collect()
}

/// A sensor 0.8 m above the floor.
pub(super) fn on_floor(x: f64, y: f64, yaw_deg: f64) -> Pose {
    Pose::new(Vector3::new(x, y, 0.8), Vector3::z() * yaw_deg.to_radians())
}

/// An error on the floor, normal with these standard deviations (meters, degrees).
pub(super) fn noise((meters, degrees): (f64, f64), random: &mut ChaCha8Rng) -> Pose {
    let shift = Vector3::new(meters * gaussian(random), meters * gaussian(random), 0.0);
    Pose::new(shift, Vector3::z() * (degrees.to_radians() * gaussian(random)))
}

pub(super) fn covariance((meters, degrees): (f64, f64)) -> Option<PoseCovariance> {
    let variance = |row: usize| if row < 3 { meters * meters } else { degrees.to_radians().powi(2) };
    let rows: [f64; 36] = std::array::from_fn(|k| if k % 7 == 0 { variance(k / 7) } else { 0.0 });
    PoseCovariance::new(&rows).ok()
}
