//! A lidar that moves at 2 m/s and 1 rad/s is mapped alike from the clouds of every driver.

use std::sync::LazyLock;

use super::support::{DRIVERS, Driver, McapWriter, transforms};
use mrol_logs::log::{McapReader, Messages};
use mrol_logs::sequence::{LoggedScan, Odometer, Sequence, SequenceOptions};
use mrol_logs::survey::{Choice, LogSurvey, Plan};
use mrol_map::geometry::{Point, Pose, Twist, pose_difference};
use mrol_map::map::{ContentHash, MapSettings, MultiResolutionMap, RobotName};
use mrol_map::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings};
use mrol_map::util::StopSignal;
use mrol_simulate::{Scene, SpinningLidar};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const START_NS: i64 = 1_764_370_870_000_000_000;
const TURN_S: f64 = 0.1;
const TURN_NS: i64 = 100_000_000;
const SCANS: usize = 8;
const RINGS: u16 = 32;
const AZIMUTHS: u32 = 900;

/// The velocity in turn `k`: the robot is at its full speed in the sixth.
fn twist(k: usize) -> Twist {
    let share = (k as f64 / 5.0).min(1.0);
    Twist { linear: Vector3::new(2.0 * share, 0.0, 0.0), angular: Vector3::new(0.0, 0.0, share) }
}

/// Where the sensor is so many seconds after the end of turn 0: map_from_sensor.
fn true_pose(time_s: f64) -> Pose {
    let mut pose = Pose::new(Vector3::new(10.0, 5.0, 1.0), Vector3::zeros());
    let mut left_s = time_s;
    let mut k = 1;
    while left_s > TURN_S {
        pose *= twist(k).motion(TURN_S);
        (left_s, k) = (left_s - TURN_S, k + 1);
    }
    if left_s > 0.0 { pose * twist(k).motion(left_s) } else { pose }
}

/// The points of each sweep, and their times from its end.
static SWEEPS: LazyLock<Vec<(Vec<Point>, Vec<f32>)>> = LazyLock::new(|| {
    let lidar = SpinningLidar { rings: RINGS.into(), azimuths: AZIMUTHS, ..SpinningLidar::default() };
    let (scene, mut random) = (Scene::hall(1), ChaCha8Rng::seed_from_u64(1));
    let sweep = |k: usize| {
        let pose = |time_s: f64| true_pose(k as f64 * TURN_S + time_s);
        lidar.sweep(&scene, TURN_S, pose, &mut random)
    };
    (0..SCANS).map(sweep).collect()
});

/// The ride as a recorder has it: transforms at 50 Hz and up to 0.1 s late, two static publishers.
fn log_of(driver: &Driver) -> Vec<u8> {
    let mut log = McapWriter::default();
    let points = log.topic("/points", driver.type_name);
    let tf = log.topic("/tf", "tf2_msgs/msg/TFMessage");
    let tf_static = log.topic("/tf_static", "tf2_msgs/msg/TFMessage");
    let base_from_mast = Pose::new(Vector3::new(0.3, 0.0, 0.4), Vector3::new(0.0, 0.0, 0.5));
    let mast_from_lidar = Pose::new(Vector3::new(0.0, 0.1, 0.2), Vector3::new(0.02, 0.0, -0.1));
    log.message(tf_static, START_NS as u64, &transforms(0, &[("base", "mast", base_from_mast)]));
    log.message(tf_static, START_NS as u64, &transforms(0, &[("mast", "lidar", mast_from_lidar)]));
    let mut step = -10;
    let mut tell = |log: &mut McapWriter, up_to_ns: i64| {
        while START_NS + step * 20_000_000 <= up_to_ns {
            let odom_from_base = true_pose(step as f64 * 0.02) * (base_from_mast * mast_from_lidar).inverse();
            let stamp_ns = START_NS + step * 20_000_000;
            let message = transforms(stamp_ns, &[("odom", "base", odom_from_base)]);
            log.message(tf, (stamp_ns + TURN_NS) as u64, &message);
            step += 1;
        }
    };
    for (k, (sweep, times_s)) in SWEEPS.iter().enumerate() {
        let end_ns = START_NS + k as i64 * TURN_NS;
        tell(&mut log, end_ns - TURN_NS);
        log.message(points, end_ns as u64, &(driver.write)(end_ns, "lidar", sweep, times_s, RINGS));
    }
    tell(&mut log, START_NS + SCANS as i64 * TURN_NS);
    log.finish()
}

fn scans_of(log: &[u8]) -> Vec<LoggedScan> {
    let survey = LogSurvey::take(&mut McapReader::new(log).unwrap(), |_| {}).unwrap();
    let plan = Plan::of(&survey, &Choice::default()).unwrap();
    let mut sequence = Sequence::new(&survey, plan, SequenceOptions::default());
    let mut reader = McapReader::new(log).unwrap();
    let mut scans = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        sequence.take(&message);
        scans.extend(std::iter::from_fn(|| sequence.next_scan(false)));
    }
    scans.extend(std::iter::from_fn(|| sequence.next_scan(true)));
    scans
}

/// The sweeps as they were measured, stamped so long before their ends.
fn scans_without_a_log(before_ns: i64) -> Vec<LoggedScan> {
    let scan = |(k, (points, times_s)): (usize, &(Vec<Point>, Vec<f32>))| LoggedScan {
        stamp_ns: START_NS + k as i64 * TURN_NS - before_ns,
        points: points.clone(),
        times_s: Some(times_s.iter().map(|time_s| time_s + before_ns as f32 * 1e-9).collect()),
        odometry_from_sensor: Some(true_pose(k as f64 * TURN_S - before_ns as f64 * 1e-9)),
        gravity: None,
    };
    SWEEPS.iter().enumerate().map(scan).collect()
}

/// The poses at which scans are mapped, and the hash of the map.
fn mapped(scans: &[LoggedScan]) -> (Vec<Pose>, ContentHash) {
    let map = MultiResolutionMap::new(MapSettings::new(0.1, 6)).unwrap();
    let (robot, sightings) = (RobotName::new("r").unwrap(), Sightings::default());
    let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
    let mut odometer = Odometer::default();
    let mut poses = Vec::new();
    for scan in scans {
        let times_s = scan.times_s.as_ref();
        let (points, times_s): (Vec<Point>, Option<Vec<f32>>) = {
            let finite = |k: &usize| scan.points[*k].is_finite();
            let kept: Vec<usize> = (0..scan.points.len()).filter(finite).collect();
            let times_s = times_s.map(|times_s| kept.iter().map(|&k| times_s[k]).collect());
            (kept.iter().map(|&k| scan.points[k]).collect(), times_s)
        };
        let first = || scan.odometry_from_sensor.map_or(Guess::Last, Guess::Pose);
        let request = Scan {
            timestamp_ns: Some(scan.stamp_ns),
            times_s: times_s.as_deref(),
            guess: odometer.guess(scan).unwrap_or_else(first),
            ..Scan::new(&robot, &points)
        };
        let outcome = mapper.map_scan(&request, StopSignal::NEVER).unwrap();
        assert!(outcome.is_inserted(), "{}", outcome.located.alignment.reason);
        odometer.accepted(scan);
        poses.push(outcome.located.alignment.map_from_sensor);
    }
    (poses, map.content_version().hash)
}

#[test]
fn every_driver_with_times_gives_the_same_poses() {
    let references = [0, (TURN_S * 1e9 * (1.0 - 1.0 / f64::from(AZIMUTHS))) as i64].map(|before_ns| {
        let scans = scans_without_a_log(before_ns);
        (scans[0].stamp_ns, mapped(&scans).0)
    });
    for (stamp_ns, poses) in &references {
        for (k, pose) in poses.iter().enumerate() {
            let time_s = (stamp_ns - START_NS) as f64 * 1e-9 + k as f64 * TURN_S;
            let (meters, degrees) = pose_difference(&true_pose(time_s), pose);
            // It gets faster by 4 m/s^2, and velocities are taken to be constant.
            assert!(meters < 0.03 && degrees < 1.0, "scan {k}: {meters} m, {degrees} degrees");
        }
    }
    for driver in DRIVERS.iter().filter(|driver| driver.has_times) {
        let scans = scans_of(&log_of(driver));
        assert_eq!(scans.len(), SCANS, "{}", driver.name);
        let reference = references.iter().find(|(stamp_ns, _)| stamp_ns.abs_diff(scans[0].stamp_ns) < 1000);
        let (_, expected) = reference.unwrap_or_else(|| panic!("{}: {}", driver.name, scans[0].stamp_ns));
        for (k, (pose, expected)) in mapped(&scans).0.iter().zip(expected).enumerate() {
            let (meters, degrees) = pose_difference(expected, pose);
            assert!(meters < 1e-3 && degrees < 0.02, "{}: scan {k}: {meters} m, {degrees}", driver.name);
        }
    }
}

#[test]
fn a_log_gives_the_map_of_the_same_scans_and_guesses() {
    let scans = scans_of(&log_of(&DRIVERS[1]));
    let mut same = scans_without_a_log(0);
    for (same, logged) in same.iter_mut().zip(&scans) {
        assert_eq!(same.stamp_ns, logged.stamp_ns);
        assert_eq!(same.times_s.as_ref().unwrap().len(), logged.times_s.as_ref().unwrap().len());
        let (meters, degrees) =
            pose_difference(&same.odometry_from_sensor.unwrap(), &logged.odometry_from_sensor.unwrap());
        assert!(meters < 1e-9 && degrees < 1e-5, "{meters} m, {degrees} degrees");
        same.odometry_from_sensor = logged.odometry_from_sensor;
        let times_s = logged.times_s.as_ref().unwrap();
        for (same, logged) in same.times_s.iter_mut().flatten().zip(times_s) {
            assert!((*same - logged).abs() < 1e-6);
            *same = *logged;
        }
    }
    assert_eq!(mapped(&same), mapped(&scans));
}
