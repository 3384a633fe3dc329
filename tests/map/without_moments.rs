//! Alignment in maps that keep no moments: by overlap alone, judged by the centers of the voxels.

use mrol::align::{Alignment, AlignmentSettings, Verdict, align};
use mrol::geometry::{Point, Pose, pose_difference};
use mrol::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol_simulate::{Scene, tours};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const RESOLUTION_M: f64 = 0.05;

/// A rectangle with a corner and two edges, turned by `yaw` so that it lies askew in the lattice.
fn wall(corner: [f64; 3], along: [f64; 3], up: [f64; 3], yaw: f64, random: &mut ChaCha8Rng) -> Vec<Point> {
    let turn = Pose::rotation(Vector3::new(0.0, 0.0, yaw));
    let [corner, along, up] = [corner, along, up].map(Vector3::from);
    let count = (along.norm() * up.norm() / 0.02f64.powi(2)) as usize;
    let mut point = || {
        let [u, v]: [f64; 2] = std::array::from_fn(|_| random.random_range(0.0..1.0));
        Point::from(turn * Point3::from(corner + along * u + up * v))
    };
    (0..count).map(|_| point()).collect()
}

fn map_of(points: &[Point]) -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::query_only(RESOLUTION_M, 6)).unwrap();
    insert(&map, points, Pose::identity());
    map
}

fn insert(map: &MultiResolutionMap, points: &[Point], pose: Pose) {
    let pose = MappedScan::new(RobotName::new("r").unwrap(), pose);
    map.committer().insert_scan(ScanRecord::without_moments(pose, points, map.lattice()));
}

/// What `shows` of a map aligns as, seen again from `offset` with the identity as the guess.
fn aligned(map: &MultiResolutionMap, seen: &[Point], offset: Pose) -> Alignment {
    let from_sensor = |point: &Point| Point::from(offset.inverse_transform_point(&point.to_f64()));
    let scan: Vec<Point> = seen.iter().map(from_sensor).collect();
    align(map, &scan, &Pose::identity(), &AlignmentSettings::default())
}

fn offset() -> Pose {
    Pose::new(Vector3::new(0.12, -0.08, 0.05), Vector3::new(0.02, -0.03, 0.06))
}

fn corner(yaw: f64, random: &mut ChaCha8Rng) -> Vec<Point> {
    [
        wall([3.0, -2.0, -1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.5], yaw, random),
        wall([-1.0, 2.0, -1.0], [4.0, 0.0, 0.0], [0.0, 0.0, 2.5], yaw, random),
        wall([-1.0, -2.0, -1.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], yaw, random),
        wall([2.0, 0.5, -1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.5], yaw, random),
        wall([2.0, 0.5, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.5], yaw, random),
    ]
    .concat()
}

#[test]
fn a_corner_is_found_to_a_fraction_of_a_voxel_and_the_answer_says_how() {
    for yaw in [0.0, 0.35] {
        let map = map_of(&corner(yaw, &mut ChaCha8Rng::seed_from_u64(1)));
        let alignment = aligned(&map, &corner(yaw, &mut ChaCha8Rng::seed_from_u64(2)), offset());
        let (meters, degrees) = pose_difference(&alignment.map_from_sensor, &offset());
        assert_eq!(alignment.verdict, Verdict::Accepted, "{}", alignment.reason);
        assert!(meters < 0.4 * RESOLUTION_M && degrees < 0.5, "{meters} m {degrees} deg");
        assert!(alignment.reason.contains("the map keeps no moments"), "{}", alignment.reason);
    }
}

#[test]
fn one_blank_wall_leaves_the_pose_along_it_open() {
    for yaw in [0.0, 0.02] {
        let map = map_of(&wall(
            [2.0, -5.0, -3.0],
            [0.0, 10.0, 0.0],
            [0.0, 0.0, 6.0],
            yaw,
            &mut ChaCha8Rng::seed_from_u64(1),
        ));
        let seen =
            wall([2.0, -2.0, -1.2], [0.0, 4.0, 0.0], [0.0, 0.0, 2.4], yaw, &mut ChaCha8Rng::seed_from_u64(2));
        let alignment = aligned(&map, &seen, Pose::translation(0.03, 0.1, 0.0));
        assert_eq!(alignment.verdict, Verdict::Undetermined, "{yaw}: {}", alignment.reason);
    }
}

/// A corridor from `from` to `to` along its own axis, 2 m wide.
fn corridor(from: f64, to: f64, yaw: f64, seed: u64) -> Vec<Point> {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let length = [to - from, 0.0, 0.0];
    [
        wall([from, -1.02, -1.01], length, [0.0, 0.0, 2.53], yaw, random),
        wall([from, 1.03, -1.01], length, [0.0, 0.0, 2.53], yaw, random),
        wall([from, -1.02, -1.01], length, [0.0, 2.05, 0.0], yaw, random),
        wall([from, -1.02, 1.52], length, [0.0, 2.05, 0.0], yaw, random),
    ]
    .concat()
}

/// The stairs that a wall makes in a lattice which it lies askew in hold nothing.
#[test]
fn a_straight_corridor_leaves_the_pose_along_it_open_however_it_lies_in_the_lattice() {
    for (yaw_deg, seed, offset_m) in [(0.0, 2, 0.4), (5.0, 3, -0.25), (20.0, 2, -0.25), (45.0_f64, 3, 0.4)] {
        let yaw = yaw_deg.to_radians();
        let along = |m: f64| Pose::translation(m * yaw.cos(), m * yaw.sin(), 0.0);
        let map = map_of(&corridor(-6.0, 6.0, yaw, 1));
        let alignment = aligned(&map, &corridor(-2.5, 2.5, yaw, seed), along(offset_m));
        let (verdict, reason) = (alignment.verdict, &alignment.reason);
        assert_eq!(verdict, Verdict::Undetermined, "{yaw_deg} deg, {offset_m} m: {reason}");
        let [x, y, ..] = alignment.undetermined[0].direction;
        assert!((x * yaw.cos() + y * yaw.sin()).abs() > 0.9, "{yaw_deg} deg: {reason}");
    }
}

#[test]
fn a_robot_does_not_shorten_a_corridor_that_lies_askew() {
    let yaw = 20.0_f64.to_radians();
    let along = |m: f64| Pose::translation(m * yaw.cos(), m * yaw.sin(), 0.0);
    let map = map_of(&corridor(-2.5, 2.5, yaw, 1));
    for step in 1..6 {
        // It sees a corridor without an end, and its wheels say less than it went.
        let seen = corridor(-2.5, 2.5, yaw, 1 + step);
        let alignment = align(&map, &seen, &along(0.2 * step as f64), &AlignmentSettings::default());
        assert_eq!(alignment.verdict, Verdict::Undetermined, "{step}: {}", alignment.reason);
        insert(&map, &seen, along(0.25 * step as f64));
    }
}

#[test]
fn a_scan_from_elsewhere_has_little_overlap() {
    let map = map_of(&corner(0.0, &mut ChaCha8Rng::seed_from_u64(1)));
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut on_ball = || {
        let direction = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0f64)).normalize();
        Point::from(Point3::from(direction * 1.5 + Vector3::new(0.0, 0.0, 30.0)))
    };
    let ball: Vec<Point> = (0..5000).map(|_| on_ball()).collect();
    let alignment = align(&map, &ball, &Pose::identity(), &AlignmentSettings::default());
    assert_eq!(alignment.verdict, Verdict::LowOverlap, "{}", alignment.reason);
}

#[test]
fn simulated_scans_align_below_a_voxel() {
    let scene = Scene::furnished(5);
    for tour in tours(8) {
        let map = MultiResolutionMap::new(MapSettings::query_only(RESOLUTION_M, 6)).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut last = tour.poses[0];
        for (k, truth) in tour.poses.iter().enumerate() {
            let mut points = tour.sensor.scan(&scene, truth, &mut random);
            points.retain(|point| point.is_finite());
            if k > 0 {
                let alignment = align(&map, &points, &last, &AlignmentSettings::default());
                let (meters, degrees) = pose_difference(&alignment.map_from_sensor, truth);
                assert_eq!(alignment.verdict, Verdict::Accepted, "{} {k}: {}", tour.name, alignment.reason);
                assert!(
                    meters < RESOLUTION_M && degrees < 1.5,
                    "{} {k}: {meters} m {degrees} deg",
                    tour.name
                );
                last = alignment.map_from_sensor;
            }
            insert(&map, &points, last);
        }
    }
}
