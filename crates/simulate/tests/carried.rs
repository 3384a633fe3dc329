//! A robot that was carried to where a scan fits as well is not believed there: to another floor, or this side of a
//! thin wall. And true odometry is not overruled by far where rays cannot tell.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

use mrol_map::geometry::{Point, Pose, pose_difference};
use mrol_map::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol_map::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings};
use mrol_map::util::StopSignal;
use mrol_simulate::{Scene, SpinningLidar};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const RESOLUTION_M: f64 = 0.1;

struct Mapped {
    map: MultiResolutionMap,
    sightings: Sightings,
    robot: RobotName,
}

impl Mapped {
    fn new(resolution_m: f64) -> Self {
        let map = MultiResolutionMap::new(MapSettings::new(resolution_m, 5)).unwrap();
        Self { map, sightings: Sightings::default(), robot: RobotName::new("r").unwrap() }
    }

    fn mapper(&self) -> ScanMapper<'_> {
        ScanMapper::new(&self.map, &self.sightings, MappingSettings::default())
    }

    fn add(&self, points: &[Point], map_from_sensor: Pose) {
        let guess = Guess::Pose(map_from_sensor);
        let scan = Scan { guess, at_guess: true, ..Scan::new(&self.robot, points) };
        assert!(self.mapper().map_scan(&scan, StopSignal::NEVER).unwrap().is_inserted());
    }

    /// Aligns a scan from a guess. It may be refused; accepted it has to be so near to where it was taken.
    fn assert_not_misled(&self, points: &[Point], guess: Guess, truth: &Pose, off_max_m: f64) {
        let scan = Scan { guess, ..Scan::new(&self.robot, points) };
        let found = self.mapper().locate(&scan, StopSignal::NEVER).unwrap().alignment;
        let (meters, degrees) = pose_difference(&found.map_from_sensor, truth);
        let is_right = meters < off_max_m && degrees < 2.0;
        let was = format!("accepted {meters:.2} m {degrees:.1} deg off: {}", found.reason);
        assert!(is_right || found.verdict != mrol_map::align::Verdict::Accepted, "{was}");
    }
}

fn finite(points: Vec<Point>) -> Vec<Point> {
    points.into_iter().filter(|point| point.is_finite()).collect()
}

fn at(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
    Pose::new(Vector3::new(x, y, z), Vector3::z() * yaw)
}

/// A scan of 16 rings in a corridor along x without an end, of a sensor 1 m above its floor.
fn corridor(width_m: f64, map_from_sensor: &Pose, random: &mut ChaCha8Rng) -> Vec<Point> {
    let mut points = Vec::new();
    for ring in 0..16 {
        let elevation = (f64::from(ring) * 2.0 - 15.0).to_radians();
        for azimuth in 0..900 {
            let (sin, cos) = (f64::from(azimuth) * 0.4).to_radians().sin_cos();
            let ray = Vector3::new(elevation.cos() * cos, elevation.cos() * sin, elevation.sin());
            let (from, way) = (map_from_sensor.translation.vector, map_from_sensor.rotation * ray);
            let to_plane = |at: f64, k: usize| {
                let range_m = (at - from[k]) / way[k];
                if range_m > 0.0 { range_m } else { f64::MAX }
            };
            let half = 0.5 * width_m;
            let planes = [(half, 1), (-half, 1), (-1.0, 2), (1.8, 2)];
            let range_m = planes.map(|(at, k)| to_plane(at, k)).into_iter().fold(f64::MAX, f64::min);
            if range_m < 60.0 {
                let noise_m: f64 = (0..4).map(|_| random.random_range(-0.013..0.013)).sum();
                let [x, y, z]: [f64; 3] = (ray * (range_m + noise_m)).into();
                points.push(Point::new(x as f32, y as f32, z as f32));
            }
        }
    }
    points
}

#[test]
fn along_a_bare_corridor_no_pose_is_believed_that_odometry_rules_out() {
    for seed in 0..10 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let width_m = random.random_range(1.8..3.0);
        let mapped = Mapped::new(RESOLUTION_M);
        let along = |x: f64, random: &mut ChaCha8Rng| {
            let mut small = || random.random_range(-0.015..0.015);
            Pose::from_parts(
                Translation3::new(x, small(), small()),
                UnitQuaternion::from_euler_angles(small(), small(), 2.0 * small()),
            )
        };
        let places = [-4.0, -3.0, -2.0, -1.0, 0.0].map(|x| along(x, &mut random));
        for place in places {
            mapped.add(&corridor(width_m, &place, &mut random), place);
        }
        let [.., last] = places;
        let truth = along(random.random_range(0.5..1.2), &mut random);
        let off = Pose::translation(random.random_range(-0.01..0.01), random.random_range(-0.01..0.01), 0.0);
        let motion = last.inverse() * truth * off;
        // Three deviations of what odometry is expected to err by, a tenth of the way, and of a voxel.
        let off_max_m = 3.0 * (0.1 * motion.translation.vector.norm()).hypot(RESOLUTION_M) + 0.02;
        let points = corridor(width_m, &truth, &mut random);
        mapped.assert_not_misled(&points, Guess::Motion(motion), &truth, off_max_m);
    }
}

#[test]
fn a_robot_that_a_lift_took_up_unseen_is_not_believed_below() {
    let lidar =
        SpinningLidar { rings: 16, azimuths: 720, elevation_max_deg: 20.0, ..SpinningLidar::default() };
    for seed in 0..8 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mapped = Mapped::new(RESOLUTION_M);
        let floors = [0, 1].map(|floor| Scene::rectangular_room(500 + 2 * seed + floor, [9.0, 7.0], 3));
        let heights = [Pose::identity(), Pose::translation(0.0, 0.0, 3.2)];
        for (scene, map_from_room) in floors.iter().zip(&heights).rev() {
            for k in 0..5 {
                let room_from_sensor =
                    at(0.3 * f64::from(k) - 0.6, 0.1 * f64::from(k % 2), 0.8, 0.1 * f64::from(k));
                let points = finite(lidar.scan(scene, &room_from_sensor, &mut random));
                mapped.add(&points, map_from_room * room_from_sensor);
            }
        }
        let room_from_sensor = at(0.7, 0.2, 0.8, 0.5);
        let points = finite(lidar.scan(&floors[1], &room_from_sensor, &mut random));
        mapped.assert_not_misled(&points, Guess::Last, &(heights[1] * room_from_sensor), 2.0 * RESOLUTION_M);
    }
}

/// The floors have the same walls and half of the furniture: what differs contradicts one side of a scan, if that.
#[test]
fn a_robot_is_not_believed_on_the_floor_that_it_left_where_furniture_alone_tells_them_apart() {
    let lidar =
        SpinningLidar { rings: 16, azimuths: 720, elevation_max_deg: 20.0, ..SpinningLidar::default() };
    for seed in 0..8 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mapped = Mapped::new(RESOLUTION_M);
        let floors = [0, 3].map(|moved| Scene::rearranged_room(700 + seed, [9.0, 7.0], 6, moved));
        let heights = [Pose::identity(), Pose::translation(0.0, 0.0, 3.0)];
        let mut last = Pose::identity();
        for (scene, map_from_room) in floors.iter().zip(&heights).rev() {
            for k in 0..4 {
                let room_from_sensor =
                    at(0.5 * f64::from(k) - 0.6, 0.3 * f64::from(k % 2), 0.8, 0.7 * f64::from(k));
                let points = finite(lidar.scan(scene, &room_from_sensor, &mut random));
                last = room_from_sensor;
                mapped.add(&points, map_from_room * room_from_sensor);
            }
        }
        let points = finite(lidar.scan(&floors[1], &last, &mut random));
        for guess in [Guess::Last, Guess::Motion(at(0.05, 0.0, 0.0, 0.02))] {
            mapped.assert_not_misled(&points, guess, &(heights[1] * last), 2.0 * RESOLUTION_M);
        }
    }
}

/// A wall of 12 cm has two faces: that which the next room shows is not that which this one showed.
#[test]
fn a_room_behind_a_thin_wall_is_not_moved_by_the_thickness_of_the_wall() {
    const RESOLUTION_M: f64 = 0.05;
    let lidar =
        SpinningLidar { rings: 16, azimuths: 720, elevation_max_deg: 20.0, ..SpinningLidar::default() };
    for seed in 0..8 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mapped = Mapped::new(RESOLUTION_M);
        let building = Scene::furnished(seed);
        let placed = |x_m: f64, random: &mut ChaCha8Rng| {
            loop {
                let mut somewhere = |half: f64| random.random_range(-half..half);
                let place = at(x_m + somewhere(2.0), 7.2 + somewhere(1.0), 0.8, somewhere(3.0));
                let points = finite(lidar.scan(&building, &place, random));
                // Not in the middle of a cupboard.
                if points.len() > 5000 {
                    return (points, place);
                }
            }
        };
        for _ in 0..6 {
            let (points, place) = placed(3.0, &mut random);
            mapped.add(&points, place);
        }
        let (points, truth) = placed(9.5, &mut random);
        let mut somewhere = |half: f64| random.random_range(-half..half);
        let guess = truth * at(somewhere(0.02), somewhere(0.02), 0.0, somewhere(0.01));
        mapped.assert_not_misled(&points, Guess::Pose(guess), &truth, 1.8 * RESOLUTION_M);
    }
}

/// Wheels that say nothing of a turn are wrong, and then speak for no pose that is turned otherwise either.
#[test]
fn a_robot_that_was_turned_in_place_against_its_odometry_is_not_believed_elsewhere() {
    let lidar =
        SpinningLidar { rings: 16, azimuths: 720, elevation_max_deg: 20.0, ..SpinningLidar::default() };
    for seed in 0..24 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mapped = Mapped::new(RESOLUTION_M);
        let pieces = 2 + seed as usize % 2;
        let room = Scene::rectangular_room(900 + seed, [9.0, 6.0], pieces);
        let mut last = Pose::identity();
        for k in 0..6 {
            let mut somewhere = |half_m: f64| random.random_range(-half_m..half_m);
            last = at(somewhere(2.0), somewhere(1.0), 0.8, f64::from(k));
            mapped.add(&finite(lidar.scan(&room, &last, &mut random)), last);
        }
        let truth = last * at(0.0, 0.0, 0.0, std::f64::consts::PI);
        let rearranged = Scene::rearranged_room(900 + seed, [9.0, 6.0], pieces, 1);
        let points = finite(lidar.scan(&rearranged, &truth, &mut random));
        let standing = Guess::Motion(Pose::identity());
        mapped.assert_not_misled(&points, standing, &truth, 2.0 * RESOLUTION_M);
    }
}

/// The floor and the ceiling are hardly in view of both sensors, so that little holds the height of the second one: the
/// guess is as likely as where its surfaces pull the scan.
#[test]
fn a_true_guess_of_another_height_is_not_overruled_where_rays_cannot_tell() {
    let lidar =
        SpinningLidar { rings: 16, azimuths: 900, elevation_max_deg: 15.0, ..SpinningLidar::default() };
    for seed in 0..24 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mapped = Mapped::new(RESOLUTION_M);
        let room = Scene::furnished(seed);
        let mut place = |z: f64| {
            at(
                random.random_range(4.0..6.0),
                random.random_range(3.0..5.0),
                z,
                random.random_range(-3.0..3.0),
            )
        };
        let (first, truth) = (place(0.5), place(0.5 + 0.3 * (1 + seed % 4) as f64));
        let mut scan = |place: &Pose| finite(lidar.scan(&room, place, &mut random));
        let (before, points) = (scan(&first), scan(&truth));
        if before.len().min(points.len()) < 5000 {
            // In a piece of furniture.
            continue;
        }
        mapped.add(&before, first);
        mapped.assert_not_misled(&points, Guess::Pose(truth), &truth, 4.0 * RESOLUTION_M);
    }
}
