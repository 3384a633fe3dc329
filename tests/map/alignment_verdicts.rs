//! Poses that the geometry holds are accepted and end far below a voxel; those that it leaves open are told apart.

use mrol::align::{Alignment, AlignmentSettings, MultiStartSettings, Verdict, align};
use mrol::geometry::{Point, Pose, pose_difference};
use mrol::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol_simulate::{Scene, tours};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const RESOLUTION_M: f64 = 0.05;
const NOISE_M: f64 = 0.005;

/// A rectangle with corner, two edges; a point about each 2.5 cm with noise across it.
fn wall(corner: [f64; 3], along: [f64; 3], up: [f64; 3], random: &mut ChaCha8Rng) -> Vec<Point> {
    let [corner, along, up] = [corner, along, up].map(Vector3::from);
    let normal = along.cross(&up).normalize();
    let count = (along.norm() * up.norm() / 0.025f64.powi(2)) as usize;
    (0..count)
        .map(|_| {
            let [u, v, across]: [f64; 3] = std::array::from_fn(|_| random.random_range(0.0..1.0));
            let noise = normal * (across - 0.5) * 2.0 * NOISE_M;
            Point::from(Point3::from(corner + along * u + up * v + noise))
        })
        .collect()
}

fn map_of(points: &[Point]) -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 6)).unwrap();
    insert(&map, points, Pose::identity());
    map
}

fn insert(map: &MultiResolutionMap, points: &[Point], pose: Pose) {
    let pose = MappedScan::new(RobotName::new("r").unwrap(), pose);
    map.committer().insert_scan(ScanRecord::of_points(pose, points, map.lattice()));
}

/// Another look at what the map shows, from `offset`: the scan of a sensor there, and its true pose.
fn aligned(shows: impl Fn(&mut ChaCha8Rng) -> Vec<Point>, offset: Pose) -> (Alignment, Pose) {
    let map = map_of(&shows(&mut ChaCha8Rng::seed_from_u64(1)));
    let scan: Vec<Point> = shows(&mut ChaCha8Rng::seed_from_u64(2))
        .into_iter()
        .map(|point| Point::from(offset.inverse_transform_point(&point.to_f64())))
        .collect();
    (align(&map, &scan, &Pose::identity(), &AlignmentSettings::default()), offset)
}

fn offset() -> Pose {
    Pose::new(Vector3::new(0.12, -0.08, 0.05), Vector3::new(0.02, -0.03, 0.06))
}

/// Three walls of a corner, and a cupboard in it.
fn corner(random: &mut ChaCha8Rng) -> Vec<Point> {
    [
        wall([3.0, -2.0, -1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.5], random),
        wall([-1.0, 2.0, -1.0], [4.0, 0.0, 0.0], [0.0, 0.0, 2.5], random),
        wall([-1.0, -2.0, -1.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], random),
        wall([2.0, 0.5, -1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.5], random),
        wall([2.0, 0.5, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.5], random),
    ]
    .concat()
}

#[test]
fn a_corner_holds_the_pose_to_a_hundredth_of_a_voxel_edge() {
    let (alignment, truth) = aligned(corner, offset());
    let (meters, degrees) = pose_difference(&alignment.map_from_sensor, &truth);
    assert_eq!(alignment.verdict, Verdict::Accepted, "{}", alignment.reason);
    assert!(meters < 0.001 && degrees < 0.05, "{meters} m {degrees} deg");
    assert!(alignment.overlap() > 0.6 && alignment.inliers > 0.9 && alignment.undetermined.is_empty());
    // The error is one that the information matrix expects.
    let worst = alignment.information.directions()[0].std_m;
    assert!(meters < 4.0 * worst && worst < 0.2 * RESOLUTION_M, "{meters} m, std {worst} m");
}

#[test]
fn one_blank_wall_leaves_the_pose_along_it_open() {
    // Wider than the sensor sees: nothing of its rim is in view.
    let seen = |random: &mut ChaCha8Rng| wall([2.0, -2.0, -1.2], [0.0, 4.0, 0.0], [0.0, 0.0, 2.4], random);
    let map = map_of(&wall(
        [2.0, -5.0, -3.0],
        [0.0, 10.0, 0.0],
        [0.0, 0.0, 6.0],
        &mut ChaCha8Rng::seed_from_u64(1),
    ));
    let scan = seen(&mut ChaCha8Rng::seed_from_u64(2));
    let alignment = align(&map, &scan, &Pose::translation(0.05, 0.1, 0.0), &AlignmentSettings::default());
    assert_eq!(alignment.verdict, Verdict::Undetermined, "{}", alignment.reason);
    assert!(alignment.overlap() > 0.6);
    // Across it the pose is known all the same.
    assert!((alignment.map_from_sensor.translation.x).abs() < 0.002);
    let across = alignment.undetermined.iter().map(|open| open.direction[0].abs());
    assert!(across.fold(0.0, f64::max) < 0.2, "{:?}", alignment.undetermined);
}

#[test]
fn a_straight_corridor_leaves_the_pose_along_it_open() {
    let corridor = |x: [f64; 2]| {
        move |random: &mut ChaCha8Rng| {
            let [from, length] = [x[0], x[1] - x[0]];
            [
                wall([from, -1.0, -1.0], [length, 0.0, 0.0], [0.0, 0.0, 2.5], random),
                wall([from, 1.0, -1.0], [length, 0.0, 0.0], [0.0, 0.0, 2.5], random),
                wall([from, -1.0, -1.0], [length, 0.0, 0.0], [0.0, 2.0, 0.0], random),
                wall([from, -1.0, 1.5], [length, 0.0, 0.0], [0.0, 2.0, 0.0], random),
            ]
            .concat()
        }
    };
    let map = map_of(&corridor([-12.0, 12.0])(&mut ChaCha8Rng::seed_from_u64(1)));
    let scan = corridor([-4.0, 4.0])(&mut ChaCha8Rng::seed_from_u64(2));
    let alignment = align(&map, &scan, &Pose::translation(0.1, 0.05, 0.0), &AlignmentSettings::default());
    assert_eq!(alignment.verdict, Verdict::Undetermined, "{}", alignment.reason);
    assert_eq!(alignment.undetermined.len(), 1, "{:?}", alignment.undetermined);
    assert!(alignment.undetermined[0].direction[0].abs() > 0.99, "{}", alignment.undetermined[0]);
}

#[test]
fn a_scan_from_elsewhere_has_little_overlap() {
    let map = map_of(&corner(&mut ChaCha8Rng::seed_from_u64(1)));
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let ball: Vec<Point> = (0..5000)
        .map(|_| {
            let direction = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0f64)).normalize();
            Point::from(Point3::from(direction * 1.5 + Vector3::new(0.0, 0.0, 30.0)))
        })
        .collect();
    let alignment = align(&map, &ball, &Pose::identity(), &AlignmentSettings::default());
    assert_eq!(alignment.verdict, Verdict::LowOverlap, "{}", alignment.reason);
    assert!(alignment.reason.starts_with("0.000 and 0.000"), "{}", alignment.reason);
}

#[test]
fn a_square_room_without_furniture_fits_four_ways_round() {
    let square = |random: &mut ChaCha8Rng| {
        [
            wall([-2.0, -2.0, -1.0], [4.0, 0.0, 0.0], [0.0, 0.0, 2.5], random),
            wall([-2.0, 2.0, -1.0], [4.0, 0.0, 0.0], [0.0, 0.0, 2.5], random),
            wall([-2.0, -2.0, -1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.5], random),
            wall([2.0, -2.0, -1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.5], random),
            wall([-2.0, -2.0, -1.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], random),
        ]
        .concat()
    };
    let map = map_of(&square(&mut ChaCha8Rng::seed_from_u64(1)));
    let scan = square(&mut ChaCha8Rng::seed_from_u64(2));
    let guess = Pose::rotation(Vector3::new(0.0, 0.0, 44f64.to_radians()));
    // Every end is doubted, so that others are looked for.
    let multi_start = MultiStartSettings { fitness_below: 1.0, ..MultiStartSettings::default() };
    let settings = AlignmentSettings { multi_start, ..AlignmentSettings::default() };
    let alignment = align(&map, &scan, &guess, &settings);
    assert_eq!(alignment.verdict, Verdict::Ambiguous, "{}", alignment.reason);
    let turned = alignment.rivals.iter().map(|rival| {
        let (meters, degrees) = pose_difference(&rival.map_from_sensor, &alignment.map_from_sensor);
        meters < 0.05 && (degrees - 90.0).abs() < 1.0
    });
    assert_eq!(turned.filter(|is_turned| *is_turned).count(), 2, "{:?}", alignment.rivals);
}

#[test]
fn simulated_scans_with_noise_align_well_below_a_voxel_and_alike_every_time() {
    let scene = Scene::furnished(5);
    for tour in tours(12) {
        let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 6)).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut last = tour.poses[0];
        for (k, truth) in tour.poses.iter().enumerate() {
            let mut points = tour.sensor.scan(&scene, truth, &mut random);
            points.retain(|point| point.is_finite());
            if k > 0 {
                let find = || align(&map, &points, &last, &AlignmentSettings::default());
                let alignment = find();
                assert_eq!(alignment, find());
                let (meters, degrees) = pose_difference(&alignment.map_from_sensor, truth);
                assert_eq!(alignment.verdict, Verdict::Accepted, "{} {k}: {}", tour.name, alignment.reason);
                assert!(meters < 0.02 && degrees < 0.6, "{} {k}: {meters} m {degrees} deg", tour.name);
                last = alignment.map_from_sensor;
            }
            insert(&map, &points, last);
        }
    }
}
