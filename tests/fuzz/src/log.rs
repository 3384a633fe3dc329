//! Logs of robots.

use mrol_logs::log::{McapReader, Messages};
use mrol_logs::sequence::{Sequence, SequenceOptions};
use mrol_logs::survey::{Choice, LogSurvey, Plan};
use mrol_map::geometry::Pose;

/// Topics of the log that messages are put into.
const TOPICS: [(&str, &str); 9] = [
    ("/points", "sensor_msgs/msg/PointCloud2"),
    ("/livox", "livox_ros_driver2/msg/CustomMsg"),
    ("/scan", "sensor_msgs/msg/LaserScan"),
    ("/tf", "tf2_msgs/msg/TFMessage"),
    ("/tf_static", "tf2_msgs/msg/TFMessage"),
    ("/odometry", "nav_msgs/msg/Odometry"),
    ("/imu", "sensor_msgs/msg/Imu"),
    ("/depth", "sensor_msgs/msg/Image"),
    ("/camera_info", "sensor_msgs/msg/CameraInfo"),
];
/// Bytes of a chunk, at most: the fuzzer bounds what is allocated at once.
const CHUNK_BYTES_MAX: usize = 8 << 20;
/// Characters of what is said of a log, at most.
const NOTE_MAX: usize = 4000;

/// A log: after a 0, what follows the magic of an MCAP file; after anything else, messages, each after a byte for its
/// topic and two for its length.
pub(super) fn log(bytes: &[u8]) {
    match bytes.split_first() {
        Some((0, records)) => read(&[MAGIC, records].concat()),
        Some((_, messages)) => read(&log_of(messages)),
        None => {}
    }
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn log_of(mut messages: &[u8]) -> Vec<u8> {
    let mut log = MAGIC.to_vec();
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let mut record = |code: u8, body: &[u8]| {
        log.push(code);
        log.extend((body.len() as u64).to_le_bytes());
        log.extend(body);
    };
    for (k, (topic, type_name)) in TOPICS.into_iter().enumerate() {
        let id = (k as u16 + 1).to_le_bytes();
        record(3, &[&id[..], &text(type_name), &text("ros2msg"), &text("")].concat());
        record(4, &[&id[..], &id[..], &text(topic), &text("cdr"), &[0; 4]].concat());
    }
    let mut time = 0u64;
    while let Some(([topic, low, high], rest)) = messages.split_first_chunk::<3>() {
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(rest.len());
        let (message, rest) = rest.split_at(length);
        let id = (u16::from(*topic) % TOPICS.len() as u16 + 1).to_le_bytes();
        let at = time.to_le_bytes();
        record(5, &[&id[..], &[0; 4], &at, &at, message].concat());
        // Some come late.
        (time, messages) = (time + 30_000_000, rest);
    }
    log
}

/// Reads a log as the commands do, with odometry and extrinsics and without.
fn read(log: &[u8]) {
    let reader = || McapReader::new(log).expect("its magic is there").with_chunk_bytes_max(CHUNK_BYTES_MAX);
    let survey =
        LogSurvey::take(&mut reader(), |read| assert!(read <= log.len() as u64)).expect("it is in memory");
    for extrinsics in [None, Some(Pose::translation(1.0, 0.0, 0.0))] {
        let plan = match Plan::of(&survey, &Choice { extrinsics, ..Choice::default() }) {
            Ok(plan) => plan,
            Err(why) => return check_note(&why.to_string()),
        };
        plan.missing.iter().for_each(|missing| check_note(missing));
        let bytes = survey.topics[plan.cloud].bytes;
        let options = SequenceOptions { extrinsics, ..SequenceOptions::default() };
        let mut sequence = Sequence::new(&survey, plan, options);
        let mut reader = reader();
        let mut points = 0;
        let mut take = |sequence: &mut Sequence, is_over| {
            while let Some(scan) = sequence.next_scan(is_over) {
                points += scan.points.len() as u64;
                let times = scan.times_s.as_ref().map_or(scan.points.len(), Vec::len);
                assert_eq!(times, scan.points.len());
            }
        };
        while let Some(message) = reader.next_message().expect("it is in memory") {
            sequence.take(&message);
            take(&mut sequence, false);
        }
        take(&mut sequence, true);
        assert!(points <= bytes, "{points} points of {bytes} bytes");
        sequence.notes().iter().for_each(|note| check_note(note));
    }
}

/// A note is short: a hostile log does not fill the terminal.
fn check_note(note: &str) {
    assert!(note.chars().count() < NOTE_MAX, "{note}");
}
