//! Robots that were carried away, or lost themselves, are found again, and none is found in the wrong place.

use mrol::align::PoseCovariance;
use mrol::align::localize::Supervision;
use mrol::geometry::{Point, Pose, pose_difference};
use mrol::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol::mapping::{
    Guess, LocatedScan, LostRobots, MappingSettings, Recovered, RecoverySettings, Scan, ScanMapper, Sightings,
};
use mrol::util::StopSignal;
use mrol_simulate::{Scene, SpinningLidar, tours};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const RESOLUTION_M: f64 = 0.1;
const STEPS: usize = 120;

/// A robot in a scene, and the map of the scene.
struct World {
    scene: Scene,
    map: MultiResolutionMap,
    robot: RobotName,
    sightings: Sightings,
    lost: LostRobots,
    scans: u64,
}

fn at(x: f64, y: f64, yaw_deg: f64) -> Pose {
    Pose::new(Vector3::new(x, y, 1.0), Vector3::new(0.0, 0.0, yaw_deg.to_radians()))
}

impl World {
    /// The scene, mapped by another robot from `viewpoints`.
    fn mapped(scene: Scene, viewpoints: &[Pose]) -> Self {
        let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 5)).unwrap();
        let robot = RobotName::new("r").unwrap();
        let (sightings, lost) = (Sightings::default(), LostRobots::default());
        let mut world = Self { scene, map, robot, sightings, lost, scans: 0 };
        for viewpoint in viewpoints {
            let points = world.seen_from(viewpoint);
            let pose = MappedScan::new(RobotName::new("surveyor").unwrap(), *viewpoint);
            let record = ScanRecord::of_points(pose, &points, world.map.lattice());
            world.map.committer().insert_scan(record);
        }
        world
    }

    fn seen_from(&mut self, map_from_sensor: &Pose) -> Vec<Point> {
        self.scans += 1;
        let lidar = SpinningLidar::default();
        let scan = lidar.scan(&self.scene, map_from_sensor, &mut ChaCha8Rng::seed_from_u64(self.scans));
        scan.into_iter().filter(|point| point.is_finite()).collect()
    }

    /// The robot scans from a pose; what becomes of the scan.
    fn scan(&mut self, truth: &Pose, guess: Guess) -> LocatedScan {
        let points = self.seen_from(truth);
        let scan = Scan { guess, ..Scan::new(&self.robot, &points) };
        let mapper = ScanMapper::new(&self.map, &self.sightings, MappingSettings::default());
        let mapper = mapper.recovering(&self.lost, RecoverySettings::default());
        mapper.map_scan(&scan, StopSignal::NEVER).unwrap().located
    }

    /// The same as a server does it: the search for a refused scan ends after its answer.
    fn scan_and_search_later(&mut self, truth: &Pose) -> LocatedScan {
        let points = self.seen_from(truth);
        self.map_and_search_later(&points)
    }

    fn map_and_search_later(&mut self, points: &[Point]) -> LocatedScan {
        let scan = Scan::new(&self.robot, points);
        let mapper = ScanMapper::new(&self.map, &self.sightings, MappingSettings::default());
        let mapper = mapper.recovering(&self.lost, RecoverySettings::default());
        let located = mapper.locate(&scan, StopSignal::NEVER).unwrap();
        let located = mapper.recover(&scan, located, StopSignal::NEVER).unwrap();
        if let Some(task) = mapper.begin_search(&self.robot).filter(|_| !located.is_accepted()) {
            let stop = StopSignal::NEVER;
            let alone =
                &mut Supervision { stop, search_stop: stop, progress: &mut |_| (), reserve: &mut |_| true };
            mapper.search(&task, alone).unwrap();
        }
        mapper.told(&scan, located)
    }
}

#[track_caller]
fn assert_at(located: &LocatedScan, truth: &Pose) {
    let alignment = &located.alignment;
    assert!(located.is_accepted(), "{}", alignment.reason);
    let (meters, degrees) = pose_difference(&alignment.map_from_sensor, truth);
    assert!(meters < 0.05 && degrees < 0.5, "{meters} m and {degrees} deg off");
}

/// The pose of the tour that is farther from `tour[3]` than a scan is looked for around its guess.
const FAR: usize = 100;

/// A building that no room of which looks like another, mapped from every tenth of `tour`.
fn building() -> (World, Vec<Pose>) {
    let [tour, _] = tours(STEPS);
    let viewpoints: Vec<Pose> = tour.poses.iter().step_by(10).copied().collect();
    (World::mapped(Scene::furnished(7), &viewpoints), tour.poses)
}

#[test]
fn a_robot_that_was_carried_is_found_by_a_search_that_its_next_scan_confirms() {
    let (mut building, tour) = building();
    assert_at(&building.scan(&tour[3], Guess::Pose(tour[2])), &tour[3]);
    let first = building.scan(&tour[FAR], Guess::Last);
    assert!(!first.is_accepted() && first.recovered.is_none());
    let found = building.scan(&tour[FAR + 1], Guess::Last);
    assert_at(&found, &tour[FAR + 1]);
    assert_eq!(found.recovered, Some(Recovered::Localization));
    let on_its_way = building.scan(&tour[FAR + 2], Guess::Last);
    assert_at(&on_its_way, &tour[FAR + 2]);
    assert_eq!(on_its_way.recovered, None);
}

#[test]
fn what_a_search_found_after_the_answer_the_next_scan_confirms() {
    let (mut building, tour) = building();
    assert_at(&building.scan(&tour[3], Guess::Pose(tour[2])), &tour[3]);
    let first = building.scan_and_search_later(&tour[FAR]);
    assert!(!first.is_accepted() && first.recovered.is_none());
    let reason = &first.alignment.reason;
    assert!(reason.contains("found at one place, which the next scan has to confirm"), "{reason}");
    let found = building.scan_and_search_later(&tour[FAR + 1]);
    assert_at(&found, &tour[FAR + 1]);
    assert_eq!(found.recovered, Some(Recovered::Localization));
}

/// A scan among three people, 2 m away from the sensor, who stand elsewhere in each scan.
fn among_people(points: Vec<Point>, scan: usize) -> Vec<Point> {
    let hidden = |point: Point| {
        let [x, y, z] = point.xyz();
        let (azimuth_deg, range_m) = (y.atan2(x).to_degrees(), x.hypot(y));
        let is_behind = |person: usize| {
            let at_deg = ((67 * scan + 120 * person + 220) % 360) as f32 - 180.0;
            (azimuth_deg - at_deg).abs() < 6.0 && range_m > 2.0
        };
        let scale = if (0..3).any(is_behind) { 2.0 / range_m } else { 1.0 };
        Point::new(x * scale, y * scale, z * scale)
    };
    points.into_iter().map(hidden).collect()
}

#[test]
fn a_robot_among_people_that_goes_on_in_long_steps_is_found() {
    let (mut building, tour) = building();
    assert_at(&building.scan(&tour[3], Guess::Pose(tour[2])), &tour[3]);
    // Steps of 4.7 m, and nobody tells the time: rays contradict the motion between the scans both ways.
    let [first, next] = [80, 95].map(|k| {
        let points = among_people(building.seen_from(&tour[k]), k);
        building.map_and_search_later(&points)
    });
    assert!(!first.is_accepted() && first.recovered.is_none());
    assert_at(&next, &tour[95]);
    assert_eq!(next.recovered, Some(Recovered::Localization));
}

#[test]
fn a_place_that_the_next_scan_does_not_confirm_is_given_up() {
    let (mut building, tour) = building();
    assert_at(&building.scan(&tour[3], Guess::Pose(tour[2])), &tour[3]);
    assert!(!building.scan_and_search_later(&tour[FAR]).is_accepted());
    // It was carried out of the building before it could say that it is there, and back.
    let outside = World::mapped(Scene::hall(11), &[]).seen_from(&at(8.0, 8.0, 0.0));
    assert!(!building.map_and_search_later(&outside).is_accepted());
    assert!(!building.scan_and_search_later(&tour[FAR + 1]).is_accepted());
    let found = building.scan_and_search_later(&tour[FAR + 2]);
    assert_at(&found, &tour[FAR + 2]);
    assert_eq!(found.recovered, Some(Recovered::Localization));
}

#[test]
fn a_robot_in_one_of_two_equal_rooms_is_found_in_neither_but_where_its_last_pose_says() {
    let apart_m = 12.0;
    let viewpoints = [at(2.0, 2.5, 0.0), at(5.0, 2.5, 0.0)];
    let there = viewpoints.map(|pose| Pose::translation(apart_m, 0.0, 0.0) * pose);
    let mut rooms = World::mapped(Scene::equal_rooms(5, apart_m), &[viewpoints, there].concat());
    for k in 0..2 {
        // It was never seen, and its guess is off by more than guesses are.
        let there = at(apart_m + 4.5, 2.6, 150.0 - 10.0 * f64::from(k));
        let refused = rooms.scan(&there, Guess::Pose(at(-20.0, 2.0, 0.0)));
        assert!(!refused.is_accepted(), "found at {:?}", refused.alignment.map_from_sensor);
        let reason = &refused.alignment.reason;
        assert!(reason.contains("a search with no guess: ambiguous"), "{reason}");
    }
    let start = at(2.2, 2.4, 5.0);
    assert_at(&rooms.scan(&start, Guess::Pose(at(2.0, 2.5, 0.0))), &start);
    let turned = at(2.6, 2.5, 120.0);
    assert_at(&rooms.scan(&turned, Guess::Last), &turned);
}

#[test]
fn a_robot_goes_on_from_where_its_refused_scans_lead() {
    let viewpoints = [at(4.0, 5.0, 0.0), at(8.0, 8.0, 0.0), at(12.0, 5.5, 0.0), at(16.0, 8.0, 0.0)];
    let mut hall = World::mapped(Scene::hall(3), &viewpoints);
    // A crowd that stands still: nothing of what it sees is in the map.
    let mut crowd = World::mapped(Scene::hall(11), &[]);
    let pose = |k: u32| at(4.2 + 0.5 * f64::from(k), 5.5, 5.0 + 6.0 * f64::from(k));
    assert_at(&hall.scan(&pose(0), Guess::Pose(at(4.0, 5.5, 0.0))), &pose(0));
    let mut scan = |hall: &mut World, k: u32, is_crowded: bool| {
        let mut points = hall.seen_from(&pose(k));
        if is_crowded {
            points.clear();
            let raised = |point: Point| {
                let [x, y, z] = point.xyz();
                Point::new(x, y, z + 8.0)
            };
            points.extend(crowd.seen_from(&pose(k)).into_iter().map(raised));
        }
        let mapper = ScanMapper::new(&hall.map, &hall.sightings, MappingSettings::default());
        let mapper = mapper.recovering(&hall.lost, RecoverySettings::default());
        let scan = Scan::new(&hall.robot, &points);
        let located = mapper.locate(&scan, StopSignal::NEVER).unwrap();
        mapper.recover(&scan, located, StopSignal::NEVER).unwrap()
    };
    for k in 1..12 {
        assert!(!scan(&mut hall, k, true).is_accepted(), "scan {k}");
    }
    let found = scan(&mut hall, 12, false);
    assert_at(&found, &pose(12));
    assert_eq!(found.recovered, Some(Recovered::ChainedScans));
}

#[test]
fn without_recovery_a_lost_robot_stays_lost() {
    let (mut building, tour) = building();
    assert_at(&building.scan(&tour[3], Guess::Pose(tour[2])), &tour[3]);
    for truth in &tour[FAR..FAR + 3] {
        let points = building.seen_from(truth);
        let mapper = ScanMapper::new(&building.map, &building.sightings, MappingSettings::default());
        let scan = Scan::new(&building.robot, &points);
        let located = mapper.map_scan(&scan, StopSignal::NEVER).unwrap().located;
        assert!(!located.is_accepted() && located.recovered.is_none());
    }
}

#[test]
fn a_pose_that_the_guesss_covariance_rules_out_is_not_recovered() {
    let (mut building, tour) = building();
    assert_at(&building.scan(&tour[3], Guess::Pose(tour[2])), &tour[3]);
    let points = building.seen_from(&tour[3]);
    let variances: [f64; 36] = std::array::from_fn(|k| if k % 7 == 0 { 1e-6 } else { 0.0 });
    let scan = |guess_covariance| Scan {
        guess: Guess::Pose(Pose::translation(2.0, 0.0, 0.0) * tour[3]),
        guess_covariance,
        ..Scan::new(&building.robot, &points)
    };
    let mapper = ScanMapper::new(&building.map, &building.sightings, MappingSettings::default());
    let mapper = mapper.recovering(&building.lost, RecoverySettings::default());
    let recover = |scan: &Scan<'_>| {
        let located = mapper.locate(scan, StopSignal::NEVER).unwrap();
        mapper.recover(scan, located, StopSignal::NEVER).unwrap()
    };
    let refused = recover(&scan(Some(PoseCovariance::new(&variances).unwrap())));
    assert!(!refused.is_accepted() && refused.recovered.is_none(), "{}", refused.alignment.reason);
    assert_at(&recover(&scan(None)), &tour[3]);
}

#[test]
fn where_more_starts_are_wanted_the_answer_from_one_start_says_so() {
    let (mut building, tour) = building();
    let points = building.seen_from(&tour[3]);
    let mapper = ScanMapper::new(&building.map, &building.sightings, MappingSettings::default());
    let locate = |mapper: &ScanMapper<'_>, guess| {
        let scan = Scan { guess: Guess::Pose(guess), ..Scan::new(&building.robot, &points) };
        mapper.locate(&scan, StopSignal::NEVER).unwrap().alignment
    };
    let near = locate(&mapper.from_one_start(), tour[3]);
    assert!(!near.wants_more_starts);
    assert_eq!(near, locate(&mapper, tour[3]));
    assert!(locate(&mapper.from_one_start(), tour[63]).wants_more_starts);
    assert!(!locate(&mapper, tour[63]).wants_more_starts);
}
