//! Robots that stop: what a map knows of them while nothing of what they see is new.

use mrol::align::Verdict;
use mrol::geometry::{Point, Pose, pose_difference};
use mrol::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings, StationarySettings};
use mrol::util::StopSignal;

const SECOND_NS: i64 = 1_000_000_000;

/// A hall of 24 m by 10 m with shelves, no two alike, as points on its surfaces.
fn hall() -> Vec<Point> {
    let steps = |length: f32| (0..(length / 0.12) as usize).map(|i| i as f32 * 0.12);
    let mut points = Vec::new();
    for x in steps(24.0) {
        points.extend(steps(10.0).map(|y| Point::new(x, y, 0.0)));
        points.extend(steps(2.5).flat_map(|z| [Point::new(x, 0.0, z), Point::new(x, 10.0, z)]));
    }
    for y in steps(10.0) {
        points.extend(steps(2.5).flat_map(|z| [Point::new(0.0, y, z), Point::new(24.0, y, z)]));
    }
    for (i, x) in [2.0, 5.3, 7.1, 11.2, 14.6, 16.0, 20.3, 22.1].into_iter().enumerate() {
        let (depth, height) = (1.0 + 0.3 * i as f32, 0.8 + 0.2 * i as f32);
        for d in steps(depth) {
            points.extend(steps(height).flat_map(|z| [Point::new(x, d, z), Point::new(x, 10.0 - d, z)]));
        }
    }
    points
}

fn seen_from(hall: &[Point], map_from_sensor: &Pose) -> Vec<Point> {
    let sensor_from_map = map_from_sensor.inverse();
    let near = |point: &nalgebra::Point3<f64>| point.coords.norm() < 9.0;
    let points =
        hall.iter().map(|point| sensor_from_map * nalgebra::Point3::from(point.xyz().map(f64::from)));
    points.filter(near).map(|point| Point::from([point.x, point.y, point.z].map(|c| c as f32))).collect()
}

struct Drive {
    map: MultiResolutionMap,
    sightings: Sightings,
    hall: Vec<Point>,
    robot: RobotName,
}

impl Drive {
    fn new() -> Self {
        Self {
            map: MultiResolutionMap::new(MapSettings::new(0.1, 6)).unwrap(),
            sightings: Sightings::default(),
            hall: hall(),
            robot: RobotName::new("r1").unwrap(),
        }
    }

    /// Sends a scan that is taken at `x`; whether it was kept.
    fn scan(&self, x: f64, time_ns: i64, change: impl FnOnce(&mut Scan<'_>)) -> bool {
        let truth = Pose::translation(x, 5.0, 1.0);
        let points = seen_from(&self.hall, &truth);
        let mut scan = Scan { timestamp_ns: Some(time_ns), ..Scan::new(&self.robot, &points) };
        scan.guess = if self.map.is_empty() { Guess::Pose(truth) } else { Guess::ConstantVelocity };
        change(&mut scan);
        let settings =
            MappingSettings { stationary: Some(StationarySettings::default()), ..MappingSettings::default() };
        let mapper = ScanMapper::new(&self.map, &self.sightings, settings);
        let outcome = mapper.map_scan(&scan, StopSignal::NEVER).unwrap();
        let alignment = &outcome.located.alignment;
        assert_eq!(alignment.verdict, Verdict::Accepted, "at {x} m after {time_ns} ns: {}", alignment.reason);
        let (meters, degrees) = pose_difference(&alignment.map_from_sensor, &truth);
        assert!(meters < 0.05 && degrees < 0.5, "at {x} m: {meters} m, {degrees} degrees off");
        outcome.is_inserted()
    }
}

#[test]
fn a_robot_that_stands_for_ten_minutes_goes_on() {
    let drive = Drive::new();
    let step_ns = SECOND_NS / 5;
    let (mut x, mut time_ns) = (4.0, 0);
    for _ in 0..6 {
        assert!(drive.scan(x, time_ns, |_| ()));
        (x, time_ns) = (x + 0.4, time_ns + step_ns);
    }
    x -= 0.4;
    // It stops, and sends a scan every ten seconds.
    for _ in 0..60 {
        time_ns += 10 * SECOND_NS;
        assert!(!drive.scan(x, time_ns, |_| ()), "a scan that shows nothing new was kept");
    }
    assert_eq!(drive.map.trajectory().len(), 6);
    for _ in 0..6 {
        (x, time_ns) = (x + 0.4, time_ns + step_ns);
        assert!(drive.scan(x, time_ns, |_| ()));
    }
}

#[test]
fn a_scan_that_is_to_be_in_the_map_is_kept_though_its_robot_stands() {
    let drive = Drive::new();
    assert!(drive.scan(4.0, 0, |_| ()));
    assert!(!drive.scan(4.0, SECOND_NS, |_| ()));
    assert!(drive.scan(4.0, 2 * SECOND_NS, |scan| scan.force = true));
    assert_eq!(drive.map.trajectory().len(), 2);
}
