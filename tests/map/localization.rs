//! Where in a simulated building a robot is that has no guess, and what a search says where there is nothing to find.

use mrol::align::localize::{
    Gravity, Localization, LocalizationError, LocalizationQuery, LocalizationSettings, MAP_DOWN, SearchBox,
    SearchProgress, Supervision, localize_supervised,
};
use mrol::align::{AlignmentSettings, Verdict};
use mrol::geometry::{Point, Pose, pose_difference, translation_m};
use mrol::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol::util::StopSignal;
use mrol_simulate::{Scene, Tour, tours};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const RESOLUTION_M: f64 = 0.1;
const STEPS: usize = 120;
/// Cells after which a search that may go on for minutes has said what it has to say.
const CELLS_ENOUGH: u64 = 1_000_000;

struct Building {
    scene: Scene,
    tour: Tour,
    map: MultiResolutionMap,
}

impl Building {
    /// A map of every tenth scan of the lidar's tour, at its true pose.
    fn mapped() -> Self {
        let (scene, [tour, _]) = (Scene::furnished(7), tours(STEPS));
        let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 5)).unwrap();
        for (k, pose) in tour.poses.iter().enumerate().step_by(10) {
            add(&map, &finite(&tour, &scene, k, 1), *pose);
        }
        Self { scene, tour, map }
    }

    /// Another scan of the tour, and where it was taken.
    fn scan(&self, k: usize) -> (Vec<Point>, Pose) {
        (finite(&self.tour, &self.scene, k, 2), self.tour.poses[k])
    }
}

fn finite(tour: &Tour, scene: &Scene, k: usize, seed: u64) -> Vec<Point> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed * 1000 + k as u64);
    let scan = tour.sensor.scan(scene, &tour.poses[k], &mut rng);
    scan.into_iter().filter(|point| point.is_finite()).collect()
}

fn add(map: &MultiResolutionMap, points: &[Point], map_from_sensor: Pose) {
    let pose = MappedScan::new(RobotName::new("r").unwrap(), map_from_sensor);
    map.committer().insert_scan(ScanRecord::of_points(pose, points, map.lattice()));
}

fn down(map_from_sensor: &Pose) -> Option<Gravity> {
    let in_sensor = map_from_sensor.inverse_transform_vector(&MAP_DOWN.into());
    Some(Gravity::new(in_sensor.into(), MAP_DOWN).unwrap())
}

fn query(gravity: Option<Gravity>) -> LocalizationQuery {
    LocalizationQuery { gravity, candidates: 3, ..LocalizationQuery::default() }
}

fn find(map: &MultiResolutionMap, points: &[Point], query: &LocalizationQuery) -> Localization {
    try_find(map, points, query, &LocalizationSettings::default()).unwrap()
}

fn try_find(
    map: &MultiResolutionMap,
    points: &[Point],
    query: &LocalizationQuery,
    settings: &LocalizationSettings,
) -> Result<Localization, LocalizationError> {
    until(u64::MAX, map, points, query, settings)
}

/// Searches until so many cells were looked at.
fn until(
    cells_max: u64,
    map: &MultiResolutionMap,
    points: &[Point],
    query: &LocalizationQuery,
    settings: &LocalizationSettings,
) -> Result<Localization, LocalizationError> {
    let over = std::cell::Cell::new(false);
    let is_over = || over.get();
    let supervision = &mut Supervision {
        stop: StopSignal::NEVER,
        search_stop: StopSignal::when(&is_over),
        progress: &mut |progress: &SearchProgress| over.set(over.get() || progress.cells >= cells_max),
        reserve: &mut |_| true,
    };
    localize_supervised(map, points, query, settings, &AlignmentSettings::default(), supervision)
}

#[test]
fn a_robot_is_found_in_the_building_that_another_one_mapped() {
    let building = Building::mapped();
    for k in [5, 35, 65, 95] {
        let (points, truth) = building.scan(k);
        let found = find(&building.map, &points, &query(down(&truth)));
        let (meters, degrees) = pose_difference(&found.candidates[0].map_from_sensor, &truth);
        println!(
            "scan {k}: {:?}, {} cells, {meters:.3} m {degrees:.2} degrees off",
            found.verdict, found.cells
        );
        assert!(meters < 0.05 && degrees < 0.5, "{meters} m, {degrees} degrees: {}", found.reason);
        assert!(found.exhaustive && !found.cut_short);
        assert!(found.candidates.len() <= 3);
    }
}

#[test]
fn without_gravity_the_scans_own_surfaces_lead_there() {
    let building = Building::mapped();
    let (points, truth) = building.scan(35);
    let turned = Pose::rotation(nalgebra::Vector3::new(0.4, -1.1, 2.0));
    let points: Vec<Point> = points.iter().map(|point| (turned.inverse() * point.to_f64()).into()).collect();
    let found = find(&building.map, &points, &query(None));
    let (meters, degrees) = pose_difference(&found.candidates[0].map_from_sensor, &(truth * turned));
    assert!(meters < 0.05 && degrees < 0.5, "{meters} m, {degrees} degrees: {}", found.reason);
    assert!(!found.exhaustive && !found.cut_short);
}

#[test]
fn one_seed_gives_one_answer_whatever_is_searched_for_beside() {
    let building = Building::mapped();
    let (points, truth) = building.scan(65);
    let find = || find(&building.map, &points, &query(down(&truth)));
    let first = find();
    let side_by_side =
        std::thread::scope(|scope| [scope.spawn(find), scope.spawn(find)].map(|found| found.join().unwrap()));
    assert_eq!(side_by_side, [first.clone(), first]);
}

#[test]
fn a_search_box_keeps_the_search_within() {
    let building = Building::mapped();
    let (points, truth) = building.scan(35);
    let around =
        |center: [f64; 3], by: f64| SearchBox::new(center.map(|c| c - by), center.map(|c| c + by)).ok();
    let here = LocalizationQuery { search_box: around(translation_m(&truth), 1.0), ..query(down(&truth)) };
    let (near, all) =
        (find(&building.map, &points, &here), find(&building.map, &points, &query(down(&truth))));
    assert!(pose_difference(&near.candidates[0].map_from_sensor, &truth).0 < 0.05, "{}", near.reason);
    assert!(near.cells < all.cells, "{} cells in a box, {} everywhere", near.cells, all.cells);

    let [x, y, z] = translation_m(&truth);
    let elsewhere = LocalizationQuery { search_box: around([x, y + 4.0, z + 3.0], 1.0), ..here };
    assert_ne!(find(&building.map, &points, &elsewhere).verdict, Verdict::Accepted);

    let away = LocalizationQuery { search_box: around([1e4; 3], 1.0), ..here };
    let error = try_find(&building.map, &points, &away, &LocalizationSettings::default()).unwrap_err();
    assert!(matches!(error, LocalizationError::NothingThere { .. }), "{error}");
    let endless = SearchBox::new([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).ok();
    let found = find(&building.map, &points, &LocalizationQuery { search_box: endless, ..here });
    assert!(pose_difference(&found.candidates[0].map_from_sensor, &truth).0 < 0.05);
}

#[test]
fn a_scan_from_elsewhere_is_not_accepted() {
    let building = Building::mapped();
    // Hills, as no building has.
    let hill = |i: u32| {
        let (x, y) = ((i % 120) as f32 * 0.2 - 12.0, (i / 120) as f32 * 0.2 - 12.0);
        Point::new(x, y, (x * 0.9).sin() * (y * 0.7).cos() * 2.0 - 3.0)
    };
    let hills: Vec<Point> = (0..120 * 120).map(hill).collect();
    for gravity in [down(&Pose::identity()), None] {
        let found = find(&building.map, &hills, &query(gravity));
        assert_ne!(found.verdict, Verdict::Accepted, "{}", found.reason);
    }
}

#[test]
fn one_blank_wall_fits_in_many_places() {
    let building = Building::mapped();
    let wall: Vec<Point> = (0..6400)
        .map(|i| Point::new(2.0, (i % 80) as f32 * 0.025 - 1.0, (i / 80) as f32 * 0.02 - 0.8))
        .collect();
    let (at, settings) = (query(down(&Pose::identity())), LocalizationSettings::default());
    let found = until(CELLS_ENOUGH, &building.map, &wall, &at, &settings).unwrap();
    assert_ne!(found.verdict, Verdict::Accepted, "{}", found.reason);
}

#[test]
fn a_search_that_is_stopped_answers_with_the_best_so_far() {
    let building = Building::mapped();
    let (points, truth) = building.scan(35);
    let all = find(&building.map, &points, &query(down(&truth)));
    let settings = LocalizationSettings::default();
    let stop_at = |share: f64| {
        let most = (all.cells as f64 * share) as u64;
        until(most, &building.map, &points, &query(down(&truth)), &settings).unwrap()
    };
    let at_once = stop_at(0.0);
    assert!(at_once.cut_short && !at_once.exhaustive && at_once.candidates.is_empty());
    let nearly = stop_at(0.98);
    assert!(nearly.cut_short && !nearly.exhaustive);
    assert_ne!(nearly.verdict, Verdict::Accepted, "nobody knows what the rest holds");
    assert!(pose_difference(&nearly.candidates[0].map_from_sensor, &truth).0 < 0.05);
}

#[test]
fn memory_is_bounded_and_a_box_helps() {
    let building = Building::mapped();
    let (points, truth) = building.scan(35);
    let all = query(down(&truth));
    let settings = LocalizationSettings { grid_bytes_max: 1 << 20, ..LocalizationSettings::default() };
    let coarser = try_find(&building.map, &points, &all, &settings).unwrap();
    assert!(pose_difference(&coarser.candidates[0].map_from_sensor, &truth).0 < 0.05, "{}", coarser.reason);
    let settings = LocalizationSettings { grid_bytes_max: 10_000, ..settings };
    let error = try_find(&building.map, &points, &all, &settings).unwrap_err();
    assert!(error.to_string().contains("localization_grid_bytes_max is 10000"), "{error}");
    assert!(error.to_string().contains("search_box"), "{error}");
}

#[test]
fn an_empty_map_has_no_places() {
    let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 5)).unwrap();
    let nothing =
        try_find(&map, &[Point::new(1.0, 0.0, 0.0)], &query(None), &LocalizationSettings::default());
    assert_eq!(nothing.unwrap_err(), LocalizationError::EmptyMap);
}

#[test]
fn scans_of_a_single_point_and_of_the_sensors_own_place_are_answered() {
    let building = Building::mapped();
    for points in [vec![Point::new(1.0, 0.0, 0.0)], vec![Point::new(0.0, 0.0, 0.0); 50]] {
        for gravity in [down(&Pose::identity()), None] {
            let settings = LocalizationSettings::default();
            let found = until(CELLS_ENOUGH, &building.map, &points, &query(gravity), &settings).unwrap();
            assert_ne!(found.verdict, Verdict::Accepted, "{}", found.reason);
        }
    }
}
