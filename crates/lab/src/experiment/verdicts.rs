//! Experiment on verdicts: wrong poses that are accepted and right ones that are refused, and how rays agree at both.
//!
//! Real scans with true poses are aligned to maps of one, two and half of them, from guesses at five distances; scans of other places
//! too, which belong nowhere. Simulated places, drawn by seed, are those in which robots mistake themselves: rectangular rooms in which
//! a robot was turned unseen, and aisles that repeat.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::convergence::direction;
use crate::workload::Scan;
use mrol_map::align::{
    Alignment, AlignmentSettings, PoseCovariance, PosePrior, RayAgreement, Verdict, align_until,
    ray_agreement,
};
use mrol_map::geometry::{Point, Pose, pose_difference};
use mrol_map::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol_map::mapping::{Guess, MappingSettings, Scan as MappedScan, ScanMapper, Sightings};
use mrol_map::util::StopSignal;
use mrol_simulate::{Scene, SpinningLidar, gaussian};

/// How far guesses are off, meters and degrees.
pub const GUESSES: [(f64, f64); 5] = [(0.1, 3.0), (0.3, 10.0), (1.0, 30.0), (3.0, 90.0), (8.0, 180.0)];
/// Periods of aisles, meters.
pub const PERIODS_M: [f64; 5] = [0.5, 0.8, 1.2, 2.0, 3.0];
/// Pieces of furniture in rectangular rooms.
pub const PIECES: [usize; 4] = [1, 2, 4, 8];
/// People in the view, in rectangular rooms.
pub const PEOPLE: [usize; 3] = [0, 2, 5];
/// A pose is right that is so many r_0 and degrees from the truth, at most.
const RIGHT_VOXELS: f64 = 2.0;
const RIGHT_DEG: f64 = 2.0;
/// Side of a voxel in simulated places, meters.
const SIMULATED_M: f64 = 0.1;
/// Scans of a room before the robot is turned, and steps of a drive along an aisle.
const SCANS_OF_ROOM: u32 = 8;
const STEPS_OF_DRIVE: u32 = 20;
const STEP_M: f64 = 0.4;
/// Errors of odometry along an aisle: one standard deviation, meters and degrees.
const ODOMETRY: (f64, f64) = (0.05, 2.0);

/// Which scans of a set its map is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapOf {
    /// The one in the middle.
    One,
    /// That and the next but one.
    Two,
    /// Every other one.
    Half,
}

impl MapOf {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::One, Self::Two, Self::Half];

    /// Its name in tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::One => "one scan",
            Self::Two => "two scans",
            Self::Half => "half",
        }
    }

    fn has(self, scan: usize, scans: usize) -> bool {
        let middle = scans / 2;
        match self {
            Self::One => scan == middle,
            Self::Two => scan == middle || scan == (middle + 2) % scans,
            Self::Half => scan.is_multiple_of(2),
        }
    }
}

/// What came of alignments: those that found the true pose, and those that ended elsewhere.
#[derive(Debug, Clone, Default)]
pub struct Outcomes {
    /// Accepted at the true pose.
    pub right: usize,
    /// Refused at the true pose, by [verdict](Verdict::as_str).
    pub refused: BTreeMap<&'static str, usize>,
    /// Why the true pose was refused, each time.
    pub refusals: Vec<String>,
    /// Accepted at a wrong pose: how far off each is, meters and degrees (none of a scan of another place), and the reason that was given.
    pub wrong: Vec<(Option<(f64, f64)>, String)>,
    /// Refused at a wrong pose.
    pub lost: usize,
    /// How long each took, milliseconds.
    pub took_ms: Vec<f64>,
}

impl Outcomes {
    fn add(&mut self, (alignment, took): &(Alignment, Duration), truth: Option<&Pose>, resolution_m: f64) {
        self.took_ms.push(took.as_secs_f64() * 1e3);
        let error = truth.map(|truth| pose_difference(&alignment.map_from_sensor, truth));
        let is_right = error.is_some_and(|(m, deg)| m <= RIGHT_VOXELS * resolution_m && deg <= RIGHT_DEG);
        match (alignment.verdict, is_right) {
            (Verdict::Accepted, true) => self.right += 1,
            (Verdict::Accepted, false) => self.wrong.push((error, alignment.reason.clone())),
            (verdict, true) => {
                *self.refused.entry(verdict.as_str()).or_default() += 1;
                self.refusals.push(alignment.reason.clone());
            }
            (_, false) => self.lost += 1,
        }
    }

    /// How long half of the alignments took at most, milliseconds.
    pub fn median_ms(&self) -> f64 {
        let mut took_ms = self.took_ms.clone();
        took_ms.sort_by(f64::total_cmp);
        took_ms.get(took_ms.len() / 2).copied().unwrap_or(0.0)
    }

    /// Number of alignments.
    pub fn alignments(&self) -> usize {
        self.right + self.refused.values().sum::<usize>() + self.wrong.len() + self.lost
    }
}

/// A set of scans with true poses.
#[derive(Debug)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// The place that it shows: sets of the same place have the same.
    pub place: String,
    scans: Vec<(Vec<Point>, Pose)>,
    resolution_m: f64,
}

/// A map of some scans of a set, and the scans that are aligned to it.
#[derive(Debug)]
pub struct Trials<'a> {
    map: MultiResolutionMap,
    of_map: Vec<Pose>,
    others: Vec<&'a (Vec<Point>, Pose)>,
    resolution_m: f64,
}

impl Set {
    /// A set of at most `most` of `scans`, evenly chosen; scans without a pose are left out.
    pub fn of(name: &str, place: &str, scans: Vec<Scan>, resolution_m: f64, most: usize) -> Self {
        let stride = scans.len().div_ceil(most.max(1)).max(1);
        let posed = scans.into_iter().step_by(stride);
        let scans = posed.filter_map(|scan| Some((scan.points, scan.map_from_sensor?))).collect();
        Self { name: name.into(), place: place.into(), scans, resolution_m }
    }

    /// A map of some of its scans at their true poses; none of settings out of range, or where no scan is left to align.
    pub fn trials(&self, which: MapOf) -> Option<Trials<'_>> {
        let count = self.scans.len();
        let (of_map, others): (Vec<_>, Vec<_>) =
            self.scans.iter().enumerate().partition(|(k, _)| which.has(*k, count));
        let map = mapped(of_map.iter().map(|(_, scan)| *scan), self.resolution_m)?;
        let others: Vec<_> = others.into_iter().map(|(_, scan)| scan).collect();
        let of_map = of_map.iter().map(|(_, (_, pose))| *pose).collect();
        (!others.is_empty()).then_some(Trials { map, of_map, others, resolution_m: self.resolution_m })
    }
}

impl Trials<'_> {
    /// Aligns each scan from a guess off by so much.
    pub fn align_off(
        &self,
        off: (f64, f64),
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
    ) -> Outcomes {
        let mut outcomes = Outcomes::default();
        for (points, truth) in &self.others {
            let found = aligned(&self.map, points, &off_by(truth, off, random).into(), settings);
            outcomes.add(&found, Some(truth), self.resolution_m);
        }
        outcomes
    }

    /// Aligns the scans of another place, from guesses near this map's viewpoints.
    pub fn align_others(
        &self,
        other: &Set,
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
    ) -> Outcomes {
        let mut outcomes = Outcomes::default();
        for (points, _) in &other.scans {
            let viewpoint = &self.of_map[random.random_range(0..self.of_map.len())];
            let found = aligned(&self.map, points, &off_by(viewpoint, GUESSES[2], random).into(), settings);
            outcomes.add(&found, None, self.resolution_m);
        }
        outcomes
    }

    /// How rays agree at the true pose of each scan, and at one 8 r_0 aside and turned by 10 degrees.
    pub fn agreements(
        &self,
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
    ) -> Vec<[RayAgreement; 2]> {
        let pair = |(points, truth): &&(Vec<Point>, Pose)| {
            let aside = off_by(truth, (8.0 * self.resolution_m, 10.0), random);
            let at = |pose| ray_agreement(&self.map, points, pose, settings);
            [at(truth), at(&aside)]
        };
        self.others.iter().map(pair).collect()
    }
}

/// Rectangular rooms drawn from `seed`, mapped by eight scans: the outcomes of the next scan after the robot was turned unseen, so that the
/// walls look the same, and of one after a step. None where no map can be made.
pub fn rooms(
    seed: u64,
    count: u64,
    pieces: usize,
    people: usize,
    settings: &AlignmentSettings,
) -> Option<[Outcomes; 2]> {
    let mut outcomes = <[Outcomes; 2]>::default();
    for k in 0..count {
        // Every other one is square.
        let (size_m, turn_deg) = if k.is_multiple_of(2) { ([8.0, 6.0], 180.0) } else { ([7.0, 7.0], 90.0) };
        let mut random =
            ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(k * 8 + pieces as u64));
        let scene = Scene::rectangular_room(random.random(), size_m, pieces);
        let lidar = lidar(30.0);
        let mut places = Vec::new();
        for turn in 0..SCANS_OF_ROOM {
            let [x, y] = [(); 2].map(|()| random.random_range(-0.8..0.8));
            places.push(on_floor(x, y, f64::from(turn) * 45.0));
        }
        let scans: Vec<_> =
            places.iter().map(|pose| (seen(&lidar, &scene, pose, &mut random), *pose)).collect();
        let map = mapped(scans.iter(), SIMULATED_M)?;
        let last = places.last()?;
        let now = scene.with_people(random.random(), people, [0.0, 0.0]);
        for (turn_deg, outcomes) in [turn_deg, 8.0].into_iter().zip(&mut outcomes) {
            let truth =
                *last * Pose::new(Vector3::new(0.2, -0.1, 0.0), Vector3::z() * f64::to_radians(turn_deg));
            let points = seen(&lidar, &now, &truth, &mut random);
            outcomes.add(&aligned(&map, &points, &(*last).into(), settings), Some(&truth), SIMULATED_M);
        }
    }
    Some(outcomes)
}

/// A drive along an aisle with an upright every `period_m`, mapped at its true poses: the outcomes with odometry, and with the pose before
/// as the guess. None where no map can be made.
pub fn aisle(seed: u64, period_m: f64, settings: &AlignmentSettings) -> Option<[Outcomes; 2]> {
    let mut outcomes = <[Outcomes; 2]>::default();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (scene, lidar) = (Scene::aisle(period_m, 36.0), lidar(12.0));
    let place = |step: u32| {
        let step = f64::from(step);
        on_floor(8.0 + STEP_M * step, 0.2 * (0.3 * step).sin(), 3.0 * (0.5 * step).sin())
    };
    let mut scans = Vec::new();
    for step in 0..=STEPS_OF_DRIVE {
        let truth = place(step);
        let points = seen(&lidar, &scene, &truth, &mut random);
        if step >= 2 {
            let map = mapped(scans.iter(), SIMULATED_M)?;
            let odometry = PosePrior {
                covariance: covariance(ODOMETRY),
                ..(truth * noise(ODOMETRY, &mut random)).into()
            };
            for (prior, outcomes) in [odometry, place(step - 1).into()].into_iter().zip(&mut outcomes) {
                outcomes.add(&aligned(&map, &points, &prior, settings), Some(&truth), SIMULATED_M);
            }
        }
        scans.push((points, truth));
    }
    Some(outcomes)
}

/// A pose so many meters and degrees off `truth`, in a uniform direction and about a uniform axis.
fn off_by(truth: &Pose, (meters, degrees): (f64, f64), random: &mut ChaCha8Rng) -> Pose {
    let shift = Translation3::from(direction(random) * meters);
    let turn = UnitQuaternion::from_scaled_axis(direction(random) * degrees.to_radians());
    Pose::from_parts(shift * truth.translation, turn * truth.rotation)
}

/// The random numbers of a seed.
pub fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A map of scans at their poses, with the viewpoints that they leave.
fn mapped<'s>(
    scans: impl Iterator<Item = &'s (Vec<Point>, Pose)>,
    resolution_m: f64,
) -> Option<MultiResolutionMap> {
    let map = MultiResolutionMap::new(MapSettings::new(resolution_m, 5)).ok()?;
    let (robot, sightings) = (RobotName::new("surveyor").ok()?, Sightings::default());
    let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
    for (points, pose) in scans {
        let scan =
            MappedScan { guess: Guess::Pose(*pose), at_guess: true, ..MappedScan::new(&robot, points) };
        mapper.map_scan(&scan, StopSignal::NEVER).ok()?;
    }
    Some(map)
}

fn aligned(
    map: &MultiResolutionMap,
    points: &[Point],
    prior: &PosePrior,
    settings: &AlignmentSettings,
) -> (Alignment, Duration) {
    let start = Instant::now();
    let found = align_until(map, points, prior, settings, StopSignal::NEVER);
    (found, start.elapsed())
}

/// A lidar of sixteen rings.
fn lidar(range_max_m: f64) -> SpinningLidar {
    SpinningLidar {
        rings: 16,
        azimuths: 720,
        elevation_max_deg: 20.0,
        range_max_m,
        ..SpinningLidar::default()
    }
}

/// A scan's returns.
fn seen(lidar: &SpinningLidar, scene: &Scene, pose: &Pose, random: &mut ChaCha8Rng) -> Vec<Point> {
    let is_finite = |point: &Point| point.xyz().iter().all(|c| c.is_finite());
    lidar.scan(scene, pose, random).into_iter().filter(is_finite).collect()
}

/// A sensor 0.8 m above the floor.
fn on_floor(x: f64, y: f64, yaw_deg: f64) -> Pose {
    Pose::new(Vector3::new(x, y, 0.8), Vector3::z() * yaw_deg.to_radians())
}

/// An error on the floor, normal with these standard deviations (meters, degrees).
fn noise((meters, degrees): (f64, f64), random: &mut ChaCha8Rng) -> Pose {
    let shift = Vector3::new(meters * gaussian(random), meters * gaussian(random), 0.0);
    Pose::new(shift, Vector3::z() * (degrees.to_radians() * gaussian(random)))
}

fn covariance((meters, degrees): (f64, f64)) -> Option<PoseCovariance> {
    let variance = |row: usize| if row < 3 { meters * meters } else { degrees.to_radians().powi(2) };
    let rows: [f64; 36] = std::array::from_fn(|k| if k % 7 == 0 { variance(k / 7) } else { 0.0 });
    PoseCovariance::new(&rows).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The outcomes of some simulated places, of all pieces, people and periods.
    fn added(of: impl Iterator<Item = Outcomes>) -> (usize, usize, Vec<String>) {
        of.fold((0, 0, Vec::new()), |(alignments, right, mut wrong), outcomes| {
            wrong.extend(outcomes.wrong.iter().map(|(error, reason)| format!("{error:?}: {reason}")));
            (alignments + outcomes.alignments(), right + outcomes.right, wrong)
        })
    }

    #[test]
    fn a_robot_that_was_turned_unseen_in_a_rectangular_room_is_not_believed_where_it_is_not() {
        let settings = AlignmentSettings::default();
        let rooms = |pieces| PEOPLE.map(|people| rooms(70_001, 2, pieces, people, &settings).unwrap());
        let of_rooms: Vec<[Outcomes; 2]> = [2, 4, 8].into_iter().flat_map(rooms).collect();
        for k in 0..2 {
            let (alignments, right, wrong) = added(of_rooms.iter().map(|outcomes| outcomes[k].clone()));
            assert!(wrong.is_empty(), "{wrong:?}");
            assert!(right * 4 >= alignments * 3, "{right} of {alignments} are found");
        }
    }

    #[test]
    fn a_robot_that_drives_along_shelves_stays_at_its_upright_and_says_so_where_it_does_not_know() {
        let settings = AlignmentSettings::default();
        let drives: Vec<_> = PERIODS_M.map(|period_m| aisle(70_002, period_m, &settings).unwrap()).into();
        let (alignments, right, wrong) = added(drives.iter().map(|[odometry, _]| odometry.clone()));
        assert!(wrong.is_empty(), "{wrong:?}");
        assert!(right * 100 >= alignments * 95, "{right} of {alignments} are found");
        let (_, _, wrong) = added(drives.iter().map(|[_, before]| before.clone()));
        assert!(wrong.is_empty(), "{wrong:?}");
    }
}
