//! Logs of robots: `mrol log`, and `mrol map` and `mrol insert` of one.

use std::path::Path;
use std::time::Instant;

use mrol::geometry::{Point, Pose, Twist};
use mrol::scan::read_trajectory;
use mrol_simulate::{Scene, SpinningLidar};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::{complaint, mrol, objects};
use crate::support::process::Process;

#[path = "../../crates/logs/tests/logs/support/mod.rs"]
#[expect(dead_code, unused_imports, reason = "it is used in part")]
mod support;

use support::{DRIVERS, McapWriter, transforms};

const START_NS: i64 = 1_764_370_870_000_000_000;
const TURN_S: f64 = 0.2;
const SCANS: usize = 5;
const RINGS: u16 = 16;
const SETTINGS: [&str; 4] = ["--resolution", "0.1", "--levels", "5"];

/// A log in a folder of its own.
struct Log {
    _folder: tempfile::TempDir,
    path: String,
    bytes: Vec<u8>,
}

impl Log {
    fn of(bytes: Vec<u8>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        std::fs::write(&path, &bytes).unwrap();
        Self { path: path.to_str().unwrap().to_owned(), _folder: folder, bytes }
    }

    /// A robot that drives an arc, with its transforms or without.
    fn of_a_ride(frames: bool) -> Self {
        Self::of_scans(SCANS, frames, 0)
    }

    /// The first scans of the ride; the clock is set by so much after the third.
    fn of_scans(scans: usize, frames: bool, set_by_ns: i64) -> Self {
        let mut log = McapWriter::default();
        let points = log.topic("/points", "sensor_msgs/msg/PointCloud2");
        let tf = log.topic("/tf", "tf2_msgs/msg/TFMessage");
        let tf_static = log.topic("/tf_static", "tf2_msgs/msg/TFMessage");
        let twist = Twist { linear: Vector3::new(1.5, 0.0, 0.0), angular: Vector3::new(0.0, 0.0, 0.5) };
        let start = Pose::new(Vector3::new(10.0, 5.0, 1.0), Vector3::zeros());
        let lidar = SpinningLidar { rings: RINGS.into(), azimuths: 360, ..SpinningLidar::default() };
        let (scene, mut random) = (Scene::hall(1), ChaCha8Rng::seed_from_u64(1));
        for k in 0..scans {
            let end_s = k as f64 * TURN_S;
            let end_ns = START_NS + (end_s * 1e9).round() as i64 + if k < 3 { 0 } else { set_by_ns };
            let pose = |time_s: f64| start * twist.motion(end_s + time_s);
            let (sweep, times_s): (Vec<Point>, Vec<f32>) =
                lidar.sweep(&scene, TURN_S / 2.0, pose, &mut random);
            let cloud = (DRIVERS[1].write)(end_ns, "lidar", &sweep, &times_s, RINGS);
            log.message(points, end_ns as u64, &cloud);
            if frames {
                let moved = transforms(end_ns, &[("odom", "base", twist.motion(end_s))]);
                log.message(tf, end_ns as u64 + 1000, &moved);
                log.message(tf_static, end_ns as u64, &transforms(0, &[("base", "lidar", Pose::identity())]));
            }
        }
        Self::of(log.finish())
    }
}

fn fixture() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/logs/tests/fixtures/zstd.mcap");
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_log_is_told_with_what_would_be_used_and_what_is_missing() {
    let lines = objects(&["log", &fixture()]);
    let points = lines.iter().find(|line| line["topic"] == "/points").unwrap();
    assert_eq!((&points["messages"], &points["frame"]), (&json!(6), &json!("lidar")));
    assert!((points["rate_hz"].as_f64().unwrap() - 10.0).abs() < 1e-6);
    let used = |purpose: &str| lines.iter().find(|line| line["used_for"] == purpose).unwrap().clone();
    assert_eq!(used("clouds")["source"], "/points (sensor_msgs/msg/PointCloud2, frame \"lidar\")");
    assert!(used("odometry")["source"].as_str().unwrap().contains("\"odom\""));
    assert!(used("times")["source"].as_str().unwrap().contains("ns from stamp"));
    assert_eq!(used("gravity")["source"], "/imu");
    assert!(lines.iter().all(|line| line["missing"].is_null()), "{lines:?}");

    let without = Log::of_a_ride(false);
    let lines = objects(&["log", &without.path]);
    let missing: Vec<&str> = lines.iter().filter_map(|line| line["missing"].as_str()).collect();
    assert!(missing.iter().any(|text| text.contains("no odometry")), "{missing:?}");
    let told = mrol(&["log", &without.path]).assert().success();
    let told = String::from_utf8(told.get_output().stdout.clone()).unwrap();
    assert!(told.contains("clouds    /points") && told.contains("missing   no odometry"), "{told}");
}

#[test]
fn a_log_becomes_a_map_and_the_same_one_on_a_server() {
    let log = Log::of_a_ride(true);
    let out = format!("{}.txt", log.path);
    let here = objects(&[&["map", &log.path, "--trajectory-out", &out], &SETTINGS[..]].concat());
    assert_eq!(here.len(), SCANS);
    assert!(here.iter().all(|line| line["accepted"] == true), "{here:?}");
    let poses = read_trajectory(out.as_ref()).unwrap();
    assert!((poses[1].id - (START_NS as f64 * 1e-9 + TURN_S)).abs() < 1e-6, "by stamps");
    let last = poses[SCANS - 1].map_from_sensor.translation.vector;
    assert!((last - Vector3::new(1.18, 0.24, 0.0)).norm() < 0.05, "{last}");

    let server = Process::start("", &[]);
    let insert = ["insert", &log.path, "--map", "a", "--robot", "r1", "--server", &server.grpc];
    let there = objects(&[&insert[..], &["--create"], &SETTINGS].concat());
    assert_eq!(there.len(), SCANS);
    for (here, there) in here.iter().zip(&there) {
        for field in ["scan", "verdict", "map_from_sensor", "overlap", "new_voxels"] {
            assert_eq!(here[field], there[field]);
        }
    }
    // A second start has nothing to do, says so, and adds nothing.
    let again = mrol(&[&insert[..], &["--json"]].concat()).assert().success();
    let again = again.get_output();
    assert_eq!(String::from_utf8_lossy(&again.stdout), "");
    assert!(String::from_utf8_lossy(&again.stderr).contains("goes on from there"));
    // A part of the log, and then the rest of it.
    let part = [&insert[..3], &["b"], &insert[4..]].concat();
    let first = objects(&[&part[..], &["--create", "--to", "0.5"], &SETTINGS].concat());
    let rest = objects(&part);
    assert_eq!((first.len(), rest.len()), (3, 2));
    assert_eq!(rest[1]["map_from_sensor"], there[4]["map_from_sensor"]);
    // From the middle of the log on a map begins where the odometry is.
    let late = [&insert[..3], &["d"], &insert[4..], &["--create", "--from", "0.2"], &SETTINGS].concat();
    let here = objects(&[&["map", &log.path, "--from", "0.2"], &SETTINGS[..]].concat());
    let place = &here[0]["map_from_sensor"];
    assert_eq!(objects(&late)[0]["map_from_sensor"], *place);
    assert!(place["translation_m"][0].as_f64().unwrap() > 0.05, "{place}");
    // A map that has the log already, as `mrol map` made it, does not take it from where it ended.
    let file = format!("{}.mrol", log.path);
    objects(&[&["map", &log.path, "--out", &file], &SETTINGS[..]].concat());
    objects(&["restore", &file, "--map", "e", "--server", &server.grpc]);
    let twice = ["insert", &log.path, "--map", "e", "--robot", "mrol", "--server", &server.grpc];
    let refused = mrol(&twice).assert().code(1);
    let refused = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(refused.contains("has scans of robot mrol up to") && refused.contains("--robot"), "{refused}");
    let told = mrol(&[&twice[..], &["--session", "again", "--to", "0.1"]].concat()).output().unwrap();
    assert!(!String::from_utf8_lossy(&told.stderr).contains("has scans of robot"), "{told:?}");
    // As fast as it was recorded: never faster, and the same map.
    let played = [&insert[..3], &["c"], &insert[4..], &["--create", "--real-time"], &SETTINGS].concat();
    let begin = Instant::now();
    let played = mrol(&[&played[..], &["--json"]].concat()).assert().success();
    assert!(begin.elapsed().as_secs_f64() >= TURN_S * (SCANS - 1) as f64, "{:?}", begin.elapsed());
    let (said, noted) = (&played.get_output().stdout, &played.get_output().stderr);
    assert!(String::from_utf8_lossy(noted).contains("the last scan was sent "));
    let lines: Vec<Value> =
        serde_json::Deserializer::from_slice(said).into_iter().map(Result::unwrap).collect();
    assert_eq!((lines.len(), &lines[4]["map_from_sensor"]), (SCANS, &there[4]["map_from_sensor"]));
    assert_eq!(server.stop(), Some(0));
}

#[test]
fn a_log_goes_on_where_it_ended_in_the_log_whatever_its_clock_says() {
    let server = Process::start("", &[]);
    let sent = |log: &Log, more: &[&str]| {
        let insert = ["insert", &log.path, "--map", "a", "--robot", "r1", "--server", &server.grpc, "--json"];
        let sent = mrol(&[&insert[..], more].concat()).output().unwrap();
        String::from_utf8(sent.stdout).unwrap().lines().count()
    };
    let back_ns = -10_000_000_000;
    let [part, whole] = [3, SCANS].map(|scans| Log::of_scans(scans, false, back_ns));
    assert_eq!(sent(&part, &[&["--create"], &SETTINGS[..]].concat()), 3);
    assert_eq!(sent(&whole, &[]), SCANS - 3, "those after the clock was set back");
    assert_eq!(server.stop(), Some(0));
}

#[test]
fn a_log_without_frames_is_mapped_by_constant_velocity_and_one_that_is_cut_off_up_to_there() {
    let log = Log::of_a_ride(false);
    let lines = objects(&[&["map", &log.path], &SETTINGS[..]].concat());
    assert!(lines.len() == SCANS && lines.iter().all(|line| line["accepted"] == true), "{lines:?}");
    let cut = Log::of(log.bytes[..log.bytes.len() * 7 / 10].to_vec());
    let call = mrol(&[&["map", &cut.path, "--json"], &SETTINGS[..]].concat()).assert().success();
    let (said, noted) = (&call.get_output().stdout, &call.get_output().stderr);
    let lines: Vec<Value> =
        serde_json::Deserializer::from_slice(said).into_iter().map(Result::unwrap).collect();
    assert_eq!(lines.len(), 3);
    let noted = String::from_utf8_lossy(noted);
    assert!(noted.contains("good up to byte") && noted.contains("recorder was stopped"), "{noted}");
}

#[test]
fn what_makes_no_sense_of_a_log_is_refused() {
    let log = Log::of_a_ride(false);
    let map = |more: &[&str], code| complaint(&[&["map", &log.path], &SETTINGS[..], more].concat(), code);
    assert!(map(&["--poses", "poses.txt"], 2).contains("not for a log"));
    assert!(map(&["--times", "t:ns"], 2).contains("FIELD:UNIT:FROM"));
    assert!(map(&["--every", "0"], 2).contains("--every"));
    assert!(map(&["--to", "NaN"], 2).contains("--to must be a number of seconds"));
    assert!(map(&["--cloud", "/lidar"], 1).contains("no clouds at \"/lidar\", but at /points"));
    let late = mrol(&[&["map", &log.path, "--from", "1000"], &SETTINGS[..]].concat()).assert().code(1);
    let late = String::from_utf8_lossy(&late.get_output().stderr).into_owned();
    assert!(late.contains("no cloud of the log is taken"), "{late}");
    assert!(map(&["other.ply"], 2).contains("a log is taken alone"));
    let scans = complaint(&["map", "scans", "--resolution", "0.1", "--every", "2"], 2);
    assert!(scans.contains("--every is for a log"), "{scans}");
    let scans = complaint(&["insert", "scans", "--map", "a", "--real-time"], 2);
    assert!(scans.contains("--real-time is for a log"), "{scans}");
    let nothing = Log::of(b"#ROSBAG V2.0\n".to_vec());
    assert!(complaint(&["log", &nothing.path], 1).contains("no MCAP file"));
    assert!(complaint(&["log", "there-is-none.mcap"], 1).contains("there-is-none.mcap"));
    let empty = Log::of(McapWriter::default().finish());
    assert!(complaint(&["log", &empty.path], 1).contains("no topic with clouds"));
}

#[test]
fn a_folder_of_ros_2_is_a_log_and_one_with_scan_files_beside_it_is_refused() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/logs/tests/fixtures");
    let of = |name: &str| objects(&["log", fixtures.join(name).to_str().unwrap()]);
    assert_eq!(of("bag_plain"), of("zstd.mcap"), "the same topics, uses and what is missing");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    for name in ["run_0.mcap", "run_1.mcap"] {
        std::fs::copy(fixtures.join("zstd.mcap"), folder.path().join(name)).unwrap();
    }
    assert_eq!(objects(&["log", path])[0]["messages"], 2 * of("zstd.mcap")[0]["messages"].as_u64().unwrap());
    std::fs::write(folder.path().join("0000.ply"), "").unwrap();
    let said = complaint(&["map", path, SETTINGS[0], SETTINGS[1]], 2);
    assert!(said.contains("the folder has a log, and 1 scan files such as"), "{said}");
}
