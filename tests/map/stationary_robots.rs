//! Robots that stop: what a map knows of them while nothing of what they see is new.

use mrol::align::Verdict;
use mrol::geometry::{Point, Pose, pose_difference};
use mrol::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings, StationarySettings};
use mrol::util::StopSignal;

use crate::support::hall::{hall, seen_from};

const SECOND_NS: i64 = 1_000_000_000;

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
    let mut kept = 0;
    for scan in 0..60 {
        time_ns += 10 * SECOND_NS;
        let is_kept = drive.scan(x, time_ns, |_| ());
        // The first from where it stands may see what none saw on the way.
        assert!(!is_kept || scan == 0, "scan {scan} shows nothing new and was kept");
        kept += usize::from(is_kept);
    }
    assert_eq!(drive.map.trajectory().len(), 6 + kept);
    for _ in 0..6 {
        (x, time_ns) = (x + 0.4, time_ns + step_ns);
        assert!(drive.scan(x, time_ns, |_| ()));
    }
}

#[test]
fn a_scan_that_is_to_be_in_the_map_is_kept_though_its_robot_stands() {
    let drive = Drive::new();
    // The first scans each add some voxels at the borders of what is known.
    for second in 0..5 {
        drive.scan(4.0, second * SECOND_NS, |_| ());
    }
    let stored = drive.map.trajectory().len();
    assert!(!drive.scan(4.0, 5 * SECOND_NS, |_| ()));
    assert!(drive.scan(4.0, 6 * SECOND_NS, |scan| scan.force = true));
    assert_eq!(drive.map.trajectory().len(), stored + 1);
}
