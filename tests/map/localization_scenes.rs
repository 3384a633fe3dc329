//! Where a robot with no guess is in scenes that look alike, or that the map knows in part.

use mrol::align::localize::{
    Gravity, Localization, LocalizationQuery, LocalizationSettings, MAP_DOWN, localize,
};
use mrol::align::{AlignmentSettings, Verdict};
use mrol::geometry::{Point, Pose, pose_difference};
use mrol::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings};
use mrol::util::StopSignal;
use mrol_simulate::{Scene, SpinningLidar};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Height of the upper floor above the lower one, meters.
const STOREY_M: f64 = 3.5;

struct Places {
    lidar: SpinningLidar,
    random: ChaCha8Rng,
    map: MultiResolutionMap,
    sightings: Sightings,
}

impl Places {
    fn new(seed: u64) -> Self {
        let lidar =
            SpinningLidar { rings: 16, azimuths: 720, elevation_max_deg: 20.0, ..SpinningLidar::default() };
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 5)).unwrap();
        Self { lidar, random: ChaCha8Rng::seed_from_u64(seed), map, sightings: Sightings::default() }
    }

    /// Somewhere near the middle of a room, in its frame.
    fn somewhere(&mut self, yaw: f64) -> Pose {
        let (x, y) = (self.random.random_range(-1.0..1.0), self.random.random_range(-0.8..0.8));
        Pose::new(Vector3::new(x, y, 0.8), Vector3::z() * yaw)
    }

    fn scan(&mut self, scene: &Scene, room_from_sensor: &Pose) -> Vec<Point> {
        let scan = self.lidar.scan(scene, room_from_sensor, &mut self.random);
        scan.into_iter().filter(|point| point.is_finite()).collect()
    }

    fn add(&self, points: &[Point], map_from_sensor: Pose) {
        let robot = RobotName::new("r").unwrap();
        let mapper = ScanMapper::new(&self.map, &self.sightings, MappingSettings::default());
        let scan = Scan { guess: Guess::Pose(map_from_sensor), at_guess: true, ..Scan::new(&robot, points) };
        mapper.map_scan(&scan, StopSignal::NEVER).unwrap();
    }

    /// Localizes a scan of a robot that stands upright.
    fn find(&self, points: &[Point], candidates: usize) -> Localization {
        let gravity = Gravity::new(MAP_DOWN, MAP_DOWN).ok();
        let query = LocalizationQuery { gravity, candidates, ..LocalizationQuery::default() };
        let (settings, alignment) = (LocalizationSettings::default(), AlignmentSettings::default());
        localize(&self.map, points, &query, &settings, &alignment).unwrap()
    }

    /// Localizes a scan of a robot that stands upright: it has to be found where it is, and believed.
    fn assert_found(&self, points: &[Point], map_from_sensor: &Pose) {
        let found = self.find(points, 2);
        assert!(found.rivals.is_empty(), "{:?}", found.rivals);
        assert_eq!(found.verdict, Verdict::Accepted, "{}", found.reason);
        let (meters, degrees) = pose_difference(&found.candidates[0].map_from_sensor, map_from_sensor);
        assert!(meters < 0.02 && degrees < 0.2, "{meters:.3} m {degrees:.2} deg off");
    }
}

#[test]
fn of_two_floors_with_different_furniture_the_right_one_is_believed() {
    for seed in 0..4 {
        let mut places = Places::new(seed);
        let floors = [0, 1].map(|floor| Scene::rectangular_room(100 + 2 * seed + floor, [9.0, 7.0], 5));
        let heights = [Pose::identity(), Pose::translation(0.0, 0.0, STOREY_M)];
        for (scene, map_from_room) in floors.iter().zip(&heights) {
            for k in 0..6 {
                let pose = places.somewhere(f64::from(k));
                let points = places.scan(scene, &pose);
                places.add(&points, map_from_room * pose);
            }
        }
        for (scene, map_from_room) in floors.iter().zip(&heights) {
            let yaw = places.random.random_range(-3.0..3.0);
            let pose = places.somewhere(yaw);
            let points = places.scan(scene, &pose);
            places.assert_found(&points, &(map_from_room * pose));
        }
    }
}

#[test]
fn in_a_room_that_looks_the_same_from_two_sides_the_other_side_is_told_as_a_rival() {
    for seed in 0..4 {
        let mut places = Places::new(seed);
        let scene = Scene::rectangular_room(seed, [9.0, 7.0], 0);
        for k in 0..4 {
            let pose = places.somewhere(f64::from(k));
            let points = places.scan(&scene, &pose);
            places.add(&points, pose);
        }
        let pose = places.somewhere(0.3);
        let points = places.scan(&scene, &pose);
        // However few candidates are wanted.
        let found = places.find(&points, 1);
        assert_eq!(found.verdict, Verdict::Ambiguous, "{}", found.reason);
        assert_eq!((found.candidates.len(), found.rivals.len()), (1, 1), "{:?}", found.rivals);
        let (best, rival) = (&found.candidates[0], &found.rivals[0]);
        let half_turn = Pose::rotation(Vector3::z() * std::f64::consts::PI);
        for (at, agreement) in
            [(best.map_from_sensor, best.agreement.unwrap()), (rival.map_from_sensor, rival.agreement)]
        {
            assert!(agreement.worse() > 0.98 && agreement.evidence() > 0.2, "{agreement:?}");
            let errors = [pose, half_turn * pose].map(|pose| pose_difference(&at, &pose));
            assert!(errors.iter().any(|(meters, degrees)| *meters < 0.05 && *degrees < 0.5), "{errors:?}");
        }
        let (meters, degrees) = pose_difference(&best.map_from_sensor, &rival.map_from_sensor);
        assert!(meters > 0.1 || degrees > 170.0, "{meters} m {degrees} deg apart");
    }
}

#[test]
fn candidates_are_ranked_by_the_rays_that_agree() {
    for seed in 0..4 {
        let mut places = Places::new(seed);
        let scene = Scene::rectangular_room(200 + seed, [9.0, 7.0], 3);
        for k in 0..4 {
            let pose = places.somewhere(f64::from(k));
            let points = places.scan(&scene, &pose);
            places.add(&points, pose);
        }
        let pose = places.somewhere(0.3);
        let points = places.scan(&scene, &pose);
        let found = places.find(&points, 16);
        assert!(found.candidates.len() > 1, "{:?}", found.candidates);
        let shares: Vec<f64> =
            found.candidates.iter().map(|candidate| candidate.agreement.unwrap().worse()).collect();
        assert!(shares.is_sorted_by(|a, b| a >= b), "{shares:?}");
        let (meters, degrees) = pose_difference(&found.candidates[0].map_from_sensor, &pose);
        assert!(meters < 0.02 && degrees < 0.2, "{meters:.3} m {degrees:.2} deg off: {shares:?}");
    }
}

#[test]
fn a_scan_all_around_is_found_in_a_map_of_the_front_half() {
    for seed in 0..6 {
        let mut places = Places::new(seed);
        let scene = Scene::rectangular_room(100 + 2 * seed, [9.0, 7.0], 5);
        for k in 0..4 {
            let pose = places.somewhere(0.1 * f64::from(k));
            let mut points = places.scan(&scene, &pose);
            points.retain(|point| point.xyz()[0] > 0.0);
            places.add(&points, pose);
        }
        let pose = places.somewhere(0.3);
        let points = places.scan(&scene, &pose);
        places.assert_found(&points, &pose);
    }
}
