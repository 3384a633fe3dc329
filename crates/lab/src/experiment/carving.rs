//! Experiment on carving: what a map loses of what is taken away and of who walks by, and what it keeps of what stands.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::exact_rays::ExactRays;
use mrol_map::geometry::{Point, Pose, pose_difference};
use mrol_map::map::{MapSettings, MapSettingsError, MultiResolutionMap, RobotName};
use mrol_map::mapping::{
    CarvingSettings, Guess, MappingError, MappingSettings, Scan, ScanMapper, Sightings, ViewpointSettings,
};
use mrol_map::util::StopSignal;
use mrol_map::visibility::{SensorModel, SensorRays};
use mrol_map::voxel::VoxelKey;
use mrol_simulate::{Mover, Scene, SpinningLidar};

/// Radius of the circle that the robot drives, meters, and where its middle is.
const CIRCLE_M: f64 = 3.0;
const MIDDLE_M: [f64; 2] = [10.0, 7.0];
/// Height of the sensor above the floor, meters.
const HEIGHT_M: f64 = 1.0;
/// After which share of the scans the box is taken away: the robot is 4 m from it then.
const GONE_AFTER: f64 = 0.55;
/// Of so many rays one tells a place that is free, and where along it that is.
const RAYS_APART: usize = 101;
const PASSED: f64 = 0.9;
/// Steps of the walker that are no trail yet: he stands beside them.
const FRESH_STEPS: usize = 3;

/// What is simulated: a hall with a box that is taken away halfway, and a person who walks to and fro.
#[derive(Debug, Clone)]
pub struct CarvingTrial {
    /// Scans of the robot.
    pub scans: usize,
    /// Scans of one of the robot's rounds.
    pub scans_a_round: usize,
    /// Side of a finest voxel, meters.
    pub resolution_m: f64,
    /// The robot's sensor.
    pub lidar: SpinningLidar,
    /// The model of the sensor that the scans are mapped with; none: as those of an unknown one.
    pub sensor: Option<SensorModel>,
    /// What the scans carve.
    pub carving: CarvingSettings,
    /// Take the scans at their true poses, without aligning them.
    pub at_true_poses: bool,
    /// Seed of the hall and of the noise.
    pub seed: u64,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CarvingFigures {
    /// Voxels of the box in the map when it was taken away, and how many of them the next scan left there.
    pub box_voxels: (usize, usize),
    /// Voxels of the walker's trail in a map that does not carve, and how many of them are left in the one that does.
    pub trail_voxels: (usize, usize),
    /// Voxels of walls, floor, ceiling and furniture in a map that does not carve, and how many of them are left in the
    /// one that does.
    pub still_voxels: (usize, usize),
    /// The same voxels, and those of them through whose centers a viewpoint claims to see.
    pub seen_through: (usize, usize),
    /// Places that rays passed, and those of them that are free by the viewpoints.
    pub free: (usize, usize),
    /// Scans that carved and were accepted, and those that did not carve.
    pub accepted: (usize, usize),
    /// Errors of the poses of both, meters, ascending.
    pub errors_m: (Vec<f64>, Vec<f64>),
    /// Times of one scan's carving, ascending.
    pub carve_times: Vec<Duration>,
}

impl CarvingTrial {
    /// What is in the hall beside what stands there.
    fn movers(&self) -> [Mover; 2] {
        let gone_at = self.gone_at();
        [
            Mover::Crate { bottom_m: [13.0, 10.0, 0.0], size_m: [1.2, 1.0, 1.6], gone_at },
            Mover::Walker { from_m: [9.0, 8.0], to_m: [11.5, 8.0], step_m: 0.13 },
        ]
    }

    /// The first step without the box.
    fn gone_at(&self) -> usize {
        (self.scans as f64 * GONE_AFTER) as usize
    }

    /// Where the sensor is at `step`: map_from_sensor.
    fn pose(&self, step: usize) -> Pose {
        let angle = step as f64 / self.scans_a_round as f64 * std::f64::consts::TAU;
        let [x, y] = [MIDDLE_M[0] + CIRCLE_M * angle.sin(), MIDDLE_M[1] - CIRCLE_M * angle.cos()];
        Pose::new(Vector3::new(x, y, HEIGHT_M), Vector3::new(0.0, 0.0, angle))
    }

    /// Runs it, and calls `done` after each scan.
    ///
    /// # Errors
    /// When a setting is out of range, or a scan cannot be mapped.
    pub fn run(&self, done: impl FnMut()) -> Result<CarvingFigures, CarvingTrialError> {
        Ok(self.run_with(&[(self.carving, None)], done)?.remove(0))
    }

    /// The same scans, carved by several settings, or by exact rays: what came of each.
    ///
    /// # Errors
    /// As of [`CarvingTrial::run`].
    pub fn run_with(
        &self,
        ways: &[(CarvingSettings, Option<ExactRays>)],
        mut done: impl FnMut(),
    ) -> Result<Vec<CarvingFigures>, CarvingTrialError> {
        let hall = Scene::hall(self.seed);
        let movers = self.movers();
        let mapper = |&(carving, exact): &(CarvingSettings, _)| {
            Ok::<_, CarvingTrialError>(CarvingMapper { exact, ..self.map(Some(carving))? })
        };
        let with: Result<Vec<_>, _> = ways.iter().map(mapper).collect();
        let (mut with, mut without) = (with?, self.map(None)?);
        let (mut random, mut other_random) =
            (ChaCha8Rng::seed_from_u64(self.seed), ChaCha8Rng::seed_from_u64(self.seed + 1));
        let mut still = CarvingMapper { at_true_poses: true, ..self.map(None)? };
        let mut box_voxels = vec![None; with.len()];
        let mut passed_m = Vec::new();
        for step in 0..self.scans {
            let truth = self.pose(step);
            let look = |scene: &Scene, random: &mut ChaCha8Rng| {
                let points = self.lidar.scan(scene, &truth, random);
                points.into_iter().filter(|point| point.is_finite()).collect::<Vec<Point>>()
            };
            let points = look(&hall.with_movers(&movers, step), &mut random);
            let standing = look(&hall, &mut other_random);
            still.add(step, &standing, &truth)?;
            passed_m.extend(standing.iter().step_by(RAYS_APART).map(|end| passed_by(&truth, end)));
            for (with, box_voxels) in with.iter_mut().zip(&mut box_voxels) {
                let before = (step == self.gone_at()).then(|| with.voxels());
                with.add(step, &points, &truth)?;
                if let Some(before) = before {
                    *box_voxels = Some((self.within(&movers[0], [step - 1], &before), with.voxels()));
                }
            }
            without.add(step, &points, &truth)?;
            done();
        }
        let (stands, all) = (still.voxels(), without.voxels());
        let ghosts: BTreeSet<_> = all.difference(&stands).copied().collect();
        let last = self.within(&movers[1], self.scans.saturating_sub(FRESH_STEPS)..self.scans, &ghosts);
        let trail = self.within(&movers[1], 0..self.scans, &ghosts);
        let trail: BTreeSet<_> = trail.difference(&last).copied().collect();
        let standing: BTreeSet<_> = stands.intersection(&all).copied().collect();
        let ascending = |mut errors: Vec<f64>| {
            errors.sort_unstable_by(f64::total_cmp);
            errors
        };
        let without_m = ascending(without.errors_m);
        let figures = with.into_iter().zip(box_voxels).map(|(mut with, box_voxels)| {
            let kept = with.voxels();
            let left = |of: &BTreeSet<VoxelKey>| (of.len(), of.intersection(&kept).count());
            // What stands beside the box is no part of it.
            let (of_box, after) = box_voxels.unwrap_or_default();
            let of_box: BTreeSet<_> = of_box.difference(&stands).copied().collect();
            with.carve_times.sort_unstable();
            CarvingFigures {
                box_voxels: (of_box.len(), of_box.intersection(&after).count()),
                trail_voxels: left(&trail),
                still_voxels: left(&standing),
                seen_through: with.seen_through(&standing),
                free: with.free(&passed_m),
                accepted: (with.errors_m.len(), without_m.len()),
                errors_m: (ascending(with.errors_m), without_m.clone()),
                carve_times: with.carve_times,
            }
        });
        Ok(figures.collect())
    }

    /// The voxels within a voxel of where `mover` is at one of `steps`.
    fn within(
        &self,
        mover: &Mover,
        steps: impl IntoIterator<Item = usize>,
        voxels: &BTreeSet<VoxelKey>,
    ) -> BTreeSet<VoxelKey> {
        let boxes: Vec<_> = steps.into_iter().filter_map(|step| mover.bounds_m(step)).collect();
        let is_within = |voxel: &&VoxelKey| {
            let center_m = voxel.index().map(|i| (f64::from(i) + 0.5) * self.resolution_m);
            let slack_m = 1.5 * self.resolution_m;
            boxes.iter().any(|[min_m, max_m]| {
                (0..3).all(|axis| (min_m[axis] - slack_m..=max_m[axis] + slack_m).contains(&center_m[axis]))
            })
        };
        voxels.iter().filter(is_within).copied().collect()
    }

    fn map(&self, carving: Option<CarvingSettings>) -> Result<CarvingMapper, CarvingTrialError> {
        let settings = MapSettings::new(self.resolution_m, LEVELS);
        CarvingMapper::new(settings, carving, self.at_true_poses, self.sensor)
    }
}

const LEVELS: u32 = 6;

/// A place that the ray with this end (sensor frame) passed: map frame, meters.
fn passed_by(map_from_sensor: &Pose, end: &Point) -> [f64; 3] {
    (map_from_sensor * nalgebra::Point3::from(end.to_f64().coords * PASSED)).into()
}

/// Why a trial cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum CarvingTrialError {
    /// A setting of the map is out of range.
    #[error(transparent)]
    Settings(#[from] MapSettingsError),
    /// The robot has no valid name.
    #[error(transparent)]
    Name(#[from] mrol_map::map::NameError),
    /// A scan cannot be mapped.
    #[error(transparent)]
    Mapping(#[from] MappingError),
}

/// A map of one robot, whose scans carve it or not.
#[derive(Debug)]
pub struct CarvingMapper {
    /// The map.
    pub map: MultiResolutionMap,
    robot: RobotName,
    sightings: Sightings,
    settings: MappingSettings,
    at_true_poses: bool,
    sensor: Option<SensorModel>,
    /// Carve by these in the place of the scan's surface.
    pub exact: Option<ExactRays>,
    /// Errors of the accepted scans' poses, meters.
    pub errors_m: Vec<f64>,
    /// How long each scan's carving took.
    pub carve_times: Vec<Duration>,
    /// All voxels that were carved.
    pub carved: BTreeSet<VoxelKey>,
}

impl CarvingMapper {
    /// An empty map of these settings, whose scans carve it as `carving` says; they are those of a known sensor, or of
    /// an unknown one.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn new(
        settings: MapSettings,
        carving: Option<CarvingSettings>,
        at_true_poses: bool,
        sensor: Option<SensorModel>,
    ) -> Result<Self, CarvingTrialError> {
        Ok(Self {
            map: MultiResolutionMap::new(settings)?,
            robot: RobotName::new("lidar")?,
            sightings: Sightings::default(),
            settings: MappingSettings {
                carving,
                viewpoints: ViewpointSettings {
                    thresholds: carving.unwrap_or_default().thresholds,
                    ..ViewpointSettings::default()
                },
                ..MappingSettings::default()
            },
            at_true_poses,
            sensor,
            exact: None,
            errors_m: Vec::new(),
            carve_times: Vec::new(),
            carved: BTreeSet::new(),
        })
    }

    /// Maps scan `step` (sensor frame, finite), which was taken at `truth`; the guess is the last motion, but for the
    /// first. True of one that fits.
    ///
    /// # Errors
    /// When it cannot be mapped.
    pub fn add(&mut self, step: usize, points: &[Point], truth: &Pose) -> Result<bool, CarvingTrialError> {
        let is_given = self.at_true_poses || step == 0;
        let scan = Scan {
            sensor: self.sensor.and_then(|model| SensorRays::confirmed(&model, points).ok()),
            guess: if is_given { Guess::Pose(*truth) } else { Guess::ConstantVelocity },
            at_guess: is_given,
            ..Scan::new(&self.robot, points)
        };
        let mapper = ScanMapper::new(&self.map, &self.sightings, self.settings);
        let located = mapper.locate(&scan, StopSignal::NEVER)?;
        if !located.is_accepted() {
            return Ok(false);
        }
        let mut record = mapper.record(&scan, &located, StopSignal::NEVER)?;
        let start = Instant::now();
        record.carved = match self.exact {
            None => mapper.carve(&scan, &located, &record, StopSignal::NEVER)?.voxels,
            Some(exact) => {
                let occupied = self.map.view().voxels();
                let pose = &record.pose.map_from_sensor;
                exact.carve((&occupied, &record.voxels), self.map.lattice(), pose, points)
            }
        };
        self.carve_times.push(start.elapsed());
        self.carved.extend(record.carved.iter());
        self.errors_m.push(pose_difference(truth, &located.alignment.map_from_sensor).0);
        self.map.committer().insert_scan(record);
        Ok(true)
    }

    /// How many voxels there are, and through how many centers a viewpoint claims to see.
    fn seen_through(&self, voxels: &BTreeSet<VoxelKey>) -> (usize, usize) {
        let centers_m = voxels.iter().map(|voxel| self.map.lattice().center_m(*voxel, 0));
        (voxels.len(), self.seen(centers_m))
    }

    /// How many places there are, and how many of them are free by the viewpoints.
    fn free(&self, places_m: &[[f64; 3]]) -> (usize, usize) {
        (places_m.len(), self.seen(places_m.iter().copied()))
    }

    fn seen(&self, places_m: impl Iterator<Item = [f64; 3]>) -> usize {
        let view = self.map.view().with_viewpoints();
        let Some(viewpoints) = view.viewpoints() else { return 0 };
        let mut cache = viewpoints.cache();
        places_m.filter(|place_m| cache.is_free(*place_m)).count()
    }

    /// All finest voxels of the map.
    pub fn voxels(&self) -> BTreeSet<VoxelKey> {
        self.map.view().voxels().iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_is_lost_and_what_stands_is_kept() {
        let lidar = SpinningLidar { rings: 64, azimuths: 1024, ..SpinningLidar::default() };
        let trial = CarvingTrial {
            scans: 12,
            scans_a_round: 50,
            resolution_m: 0.1,
            lidar,
            sensor: None,
            carving: CarvingSettings::default(),
            at_true_poses: true,
            seed: 1,
        };
        let CarvingFigures { box_voxels, trail_voxels, still_voxels, .. } = trial.run(|| ()).unwrap();
        // Of voxels of 10 cm more lies within the margin of the floor than of those of 5 cm, which the experiment has.
        assert!(box_voxels.0 > 100 && box_voxels.1 * 4 <= box_voxels.0, "{box_voxels:?}");
        assert!(trail_voxels.0 > 100 && trail_voxels.1 * 5 <= trail_voxels.0, "{trail_voxels:?}");
        assert!(still_voxels.1 as f64 >= 0.999 * still_voxels.0 as f64, "{still_voxels:?}");
    }
}
