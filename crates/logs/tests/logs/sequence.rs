//! Scans of logs come in the order of time, each with where the sensor was.

use std::path::Path;

use super::support::{DRIVERS, McapWriter, imu, odometry, transforms};
use mrol_logs::log::{McapReader, Messages};
use mrol_logs::sequence::{LoggedScan, Sequence, SequenceOptions};
use mrol_logs::survey::{Choice, ChoiceError, LogSurvey, OdometrySource, Plan};
use mrol_map::geometry::{Point, Pose};
use nalgebra::Vector3;

const MS: i64 = 1_000_000;
const START_NS: i64 = 1_764_370_870_000_000_000;
const TF: &str = "tf2_msgs/msg/TFMessage";

fn x(meters: f64) -> Pose {
    Pose::translation(meters, 0.0, 0.0)
}

fn survey(log: &[u8]) -> LogSurvey {
    LogSurvey::take(&mut McapReader::new(log).unwrap(), |_| {}).unwrap()
}

/// The scans of a log, and what is said of it.
fn scans(log: &[u8], choice: &Choice, options: SequenceOptions) -> (Vec<LoggedScan>, Vec<String>) {
    let survey = survey(log);
    let plan = Plan::of(&survey, choice).unwrap();
    let mut sequence = Sequence::new(&survey, plan, options);
    let mut reader = McapReader::new(log).unwrap();
    let mut scans = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        sequence.take(&message);
        scans.extend(std::iter::from_fn(|| sequence.next_scan(false)));
    }
    scans.extend(std::iter::from_fn(|| sequence.next_scan(true)));
    (scans, sequence.notes())
}

/// A log that is written message by message.
struct Robot {
    log: McapWriter,
    points: u16,
    tf: u16,
    tf_static: u16,
}

impl Robot {
    fn new() -> Self {
        let mut log = McapWriter::default();
        let points = log.topic("/points", "sensor_msgs/msg/PointCloud2");
        let (tf, tf_static) = (log.topic("/tf", TF), log.topic("/tf_static", TF));
        Self { log, points, tf, tf_static }
    }

    /// A cloud of a stamp that is recorded at a time, both in milliseconds.
    fn cloud(&mut self, log_ms: i64, stamp_ms: i64) {
        let points: Vec<_> = (0..16).map(|k| Point::new(1.0 + k as f32, 0.5, 0.0)).collect();
        let times_s: Vec<_> = (0..16).map(|k| 0.1 * (k as f32 / 15.0 - 1.0)).collect();
        let cloud = (DRIVERS[1].write)(START_NS + stamp_ms * MS, "lidar", &points, &times_s, 4);
        self.put(self.points, log_ms, &cloud);
    }

    /// That the base was at an x at a time, as recorded at another.
    fn moved(&mut self, log_ms: i64, stamp_ms: i64, meters: f64) {
        let message = transforms(START_NS + stamp_ms * MS, &[("odom", "base", x(meters))]);
        self.put(self.tf, log_ms, &message);
    }

    fn fixed(&mut self, log_ms: i64, parent: &str, child: &str, meters: f64) {
        self.put(self.tf_static, log_ms, &transforms(0, &[(parent, child, x(meters))]));
    }

    fn put(&mut self, channel: u16, log_ms: i64, message: &[u8]) {
        self.log.message(channel, (START_NS + log_ms * MS) as u64, message);
    }
}

fn at(scan: &LoggedScan) -> Option<f64> {
    scan.odometry_from_sensor.map(|pose| pose.translation.x)
}

#[test]
fn a_log_by_others_gives_its_scans_with_odometry_gravity_and_times() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/zstd.mcap");
    let log = std::fs::read(path).unwrap();
    for odometry in [None, Some("/odometry"), Some("odom")] {
        let choice = Choice { odometry: odometry.map(str::to_owned), ..Choice::default() };
        let (scans, notes) = scans(&log, &choice, SequenceOptions::default());
        assert_eq!((scans.len(), notes), (6, vec![]), "{odometry:?}");
        for (k, scan) in scans.iter().enumerate() {
            assert_eq!(scan.stamp_ns, START_NS + k as i64 * 100 * MS);
            assert!((at(scan).unwrap() - 0.1 * k as f64 - 0.5).abs() < 1e-12);
            assert_eq!(scan.points[23], Point::new(24.0, -5.75, 0.5));
            assert_eq!(scan.times_s.as_ref().map(|times_s| times_s[23]), Some(0.1));
            assert_eq!(scan.gravity.map(|gravity| gravity.in_sensor()), Some([0.0, 0.0, -1.0]));
        }
    }
    let planar = Choice { cloud: Some("/scan".to_owned()), ..Choice::default() };
    let missing = Plan::of(&survey(&log), &planar).unwrap().missing;
    assert!(missing.iter().any(|text| text.contains("scans in one plane")), "{missing:?}");
    let (scans, _) = scans(&log, &planar, SequenceOptions::default());
    assert_eq!(scans.len(), 6);
    let [right, ahead, nothing] = scans[0].points[..] else { panic!("{:?}", scans[0].points) };
    assert!((right.to_f64().coords - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-6);
    assert!((ahead.to_f64().coords - Vector3::new(2.0, 0.0, 0.0)).norm() < 1e-6 && !nothing.is_finite());
    assert_eq!(scans[0].times_s.as_ref().map(|times_s| times_s[1]), Some(0.02));
}

#[test]
fn a_cloud_waits_for_transforms_that_are_late_and_static_publishers_join() {
    let mut robot = Robot::new();
    robot.moved(0, 0, 0.0);
    robot.fixed(1, "base", "mast", 0.25);
    robot.fixed(2, "base", "camera", 9.0);
    for k in 0..20 {
        robot.cloud(100 * k, 100 * k - 50);
        // Two tenths of a second late.
        robot.moved(100 * k + 10, 100 * k - 190, 0.1 * (k as f64 - 1.9));
    }
    // A program that was started long before the log, whose message came at last.
    robot.fixed(2_000, "mast", "lidar", 0.25);
    robot.moved(2_001, 2_000, 2.0);
    let (scans, notes) = scans(&robot.log.finish(), &Choice::default(), SequenceOptions::default());
    assert_eq!(notes, Vec::<String>::new());
    assert_eq!(scans.len(), 20);
    for (k, scan) in scans.iter().enumerate() {
        let true_x = 0.1 * k as f64 - 0.05 + 0.5;
        assert!((at(scan).unwrap() - true_x).abs() < 1e-9, "scan {k}: {:?}", at(scan));
    }
}

#[test]
fn transforms_are_never_extrapolated_by_more_than_a_tenth_of_a_second() {
    let mut robot = Robot::new();
    robot.fixed(0, "base", "lidar", 0.0);
    for k in 0..10 {
        robot.moved(100 * k, 100 * k, 0.1 * k as f64);
    }
    for k in 0..30 {
        robot.cloud(905 + 100 * k, 905 + 90 * k);
    }
    let (scans, notes) = scans(&robot.log.finish(), &Choice::default(), SequenceOptions::default());
    assert_eq!(scans.len(), 30);
    assert!((at(&scans[0]).unwrap() - 0.905).abs() < 1e-9 && (at(&scans[1]).unwrap() - 0.995).abs() < 1e-9);
    assert!(scans[2..].iter().all(|scan| scan.odometry_from_sensor.is_none()));
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains("no guess by odometry") && notes[0].contains("base is in odom"), "{notes:?}");
}

#[test]
fn a_missing_frame_is_told_with_what_helps_and_extrinsics_help() {
    let mut robot = Robot::new();
    for k in 0..10 {
        robot.moved(100 * k, 100 * k, 0.1 * k as f64);
        robot.cloud(100 * k + 1, 100 * k);
    }
    let log = robot.log.finish();
    let plan = Plan::of(&survey(&log), &Choice::default()).unwrap();
    assert_eq!(plan.odometry, OdometrySource::None);
    let missing = plan.missing.iter().find(|text| text.contains("odometry")).unwrap();
    for said in ["\"lidar\"", "base odom", "--extrinsics"] {
        assert!(missing.contains(said), "{missing}");
    }
    let extrinsics = Some(x(0.5));
    let choice = Choice { extrinsics, ..Choice::default() };
    let options = SequenceOptions { extrinsics, ..SequenceOptions::default() };
    let (scans, notes) = scans(&log, &choice, options);
    assert_eq!(notes, Vec::<String>::new());
    assert!((at(&scans[7]).unwrap() - 1.2).abs() < 1e-9);
}

#[test]
fn what_is_asked_for_and_not_there_is_refused_with_what_there_is() {
    let mut robot = Robot::new();
    robot.cloud(0, 0);
    robot.fixed(0, "base", "lidar", 0.5);
    let log = robot.log.finish();
    let refused = |cloud: Option<&str>, odometry: Option<&str>| {
        let [cloud, odometry] = [cloud, odometry].map(|name| name.map(str::to_owned));
        Plan::of(&survey(&log), &Choice { cloud, odometry, ..Choice::default() }).unwrap_err()
    };
    let message = refused(Some("/lidar"), None).to_string();
    assert!(message.contains("/lidar") && message.contains("/points"), "{message}");
    assert!(matches!(refused(None, Some("odom")), ChoiceError::NoSuchOdometry { .. }));
    assert!(matches!(refused(None, Some("base")), ChoiceError::Odometry { .. }));
    let none = McapWriter::default().finish();
    assert!(matches!(Plan::of(&survey(&none), &Choice::default()), Err(ChoiceError::NoClouds(_))));
}

#[test]
fn a_part_of_the_time_and_every_third_cloud() {
    let mut robot = Robot::new();
    (0..20).for_each(|k| robot.cloud(100 * k, 100 * k));
    let log = robot.log.finish();
    let options =
        SequenceOptions { from_ns: 500 * MS, to_ns: 1_200 * MS, every: 3, ..SequenceOptions::default() };
    let (scans, _) = scans(&log, &Choice::default(), options);
    let stamps: Vec<_> = scans.iter().map(|scan| (scan.stamp_ns - START_NS) / MS).collect();
    assert_eq!(stamps, [500, 800, 1100]);
}

#[test]
fn the_time_offset_is_between_sensor_and_odometry() {
    let mut robot = Robot::new();
    robot.fixed(0, "base", "lidar", 0.0);
    for k in 0..20 {
        robot.moved(100 * k, 100 * k, 0.1 * k as f64);
        robot.cloud(100 * k, 100 * k);
    }
    let options = SequenceOptions { time_offset_ns: 30 * MS, ..SequenceOptions::default() };
    let (scans, _) = scans(&robot.log.finish(), &Choice::default(), options);
    assert_eq!(scans[10].stamp_ns, START_NS + 1_000 * MS);
    assert!((at(&scans[10]).unwrap() - 1.03).abs() < 1e-9);
}

#[test]
fn clouds_that_come_too_late_are_left_out_and_a_clock_that_is_set_back_is_told() {
    let mut robot = Robot::new();
    for (log_ms, stamp_ms) in [(0, 0), (1, 100), (2, 50), (3, 100), (4, 200), (5, -90_000), (6, -89_900)] {
        robot.cloud(log_ms, stamp_ms);
    }
    let (scans, notes) = scans(&robot.log.finish(), &Choice::default(), SequenceOptions::default());
    let stamps: Vec<_> = scans.iter().map(|scan| (scan.stamp_ns - START_NS) / MS).collect();
    assert_eq!(stamps, [0, 100, 200, -90_000, -89_900]);
    assert!(notes.iter().any(|note| note.contains("left out")), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("go back by 90.2")), "{notes:?}");
}

#[test]
fn odometry_of_a_topic_needs_to_know_where_the_sensor_is() {
    let mut robot = Robot::new();
    let topic = robot.log.topic("/odometry", "nav_msgs/msg/Odometry");
    for k in 0..10 {
        let message = odometry(START_NS + 100 * k * MS, "odom", "base", &x(0.1 * k as f64));
        robot.put(topic, 100 * k, &message);
        robot.cloud(100 * k + 20, 100 * k);
    }
    let imu_topic = robot.log.topic("/imu", "sensor_msgs/msg/Imu");
    robot.put(imu_topic, 1_000, &imu(START_NS, "imu", [0.0, 0.0, 9.81]));
    let log = robot.log.finish();
    let plan = Plan::of(&survey(&log), &Choice::default()).unwrap();
    assert_eq!((plan.odometry, plan.gravity), (OdometrySource::None, None));
    assert!(plan.missing.iter().any(|text| text.contains("/odometry") && text.contains("--extrinsics")));
    assert!(plan.missing.iter().any(|text| text.contains("no gravity")), "{:?}", plan.missing);
}

#[test]
fn a_first_cloud_without_the_gravity_that_was_announced_is_told() {
    let said = |stamp_ns: i64| {
        let mut robot = Robot::new();
        let imu_topic = robot.log.topic("/imu", "sensor_msgs/msg/Imu");
        robot.put(imu_topic, 0, &imu(stamp_ns, "lidar", [0.0, 0.0, 9.81]));
        (0..3).for_each(|k| robot.cloud(100 * k + 50, 100 * k + 50));
        let (scans, notes) = scans(&robot.log.finish(), &Choice::default(), SequenceOptions::default());
        let told = notes.iter().any(|note| note.contains("first cloud has no gravity"));
        (scans[0].gravity.is_some(), told)
    };
    assert_eq!(said(START_NS), (true, false));
    // By a clock of its own.
    assert_eq!(said(START_NS - 86_400_000 * MS), (false, true));
}

#[test]
fn publishers_that_contradict_each_other_are_told_once_each() {
    let mut robot = Robot::new();
    robot.fixed(0, "base", "lidar", 0.5);
    robot.fixed(1, "base", "lidar", 0.5);
    for k in 0..50 {
        robot.fixed(2, "base", "camera", if k % 2 == 0 { 0.1 } else { 0.2 });
        // Two localizations at once.
        robot.moved(k, k, 0.0);
        let other = transforms(START_NS + k * MS, &[("map", "base", x(0.0))]);
        robot.put(robot.tf, k, &other);
    }
    robot.cloud(0, 0);
    let survey = survey(&robot.log.finish());
    let told = &survey.contradictions;
    assert!(told.len() == 2 && told[0].contains("\"map\" and on \"odom\""), "{told:#?}");
    assert!(told[1].contains("\"camera\" is fixed in \"base\" at two poses, 0.100 m"), "{told:#?}");
}

#[test]
fn a_hostile_log_neither_grows_nor_hangs() {
    let mut robot = Robot::new();
    // A circle, long names, and a jump by a year.
    for (parent, child) in [("base", "lidar"), ("lidar", "base"), ("lidar", "lidar"), ("", "x")] {
        robot.fixed(0, parent, child, 1.0);
    }
    robot.fixed(0, &"n".repeat(65_536), "lidar", 1.0);
    robot.moved(0, 0, 0.0);
    robot.moved(0, 365 * 86_400_000, 1.0);
    for k in 0..300 {
        robot.cloud(0, k);
        robot.moved(0, k, 0.0);
    }
    let log = robot.log.finish();
    let survey = survey(&log);
    assert_eq!(survey.refused_transforms.len(), 4, "{:?}", survey.refused_transforms);
    assert!(survey.oddities().all(|why| why.len() < 400));
    assert_eq!(survey.contradictions, Vec::<String>::new(), "what is refused contradicts nothing");
    let (scans, notes) = scans(&log, &Choice::default(), SequenceOptions::default());
    assert_eq!(scans.len(), 300);
    assert!(scans[5].odometry_from_sensor.is_some(), "the clock came back");
    assert!(notes.iter().any(|note| note.contains("transform is left out")), "{notes:?}");
}
