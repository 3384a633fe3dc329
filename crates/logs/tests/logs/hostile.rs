//! Small logs that ask for much memory, time or space on a terminal get little of each, with a word.

use super::support::{CdrWriter, McapWriter, odometry, transforms};
use mrol_logs::cloud::{Cloud, CloudError, CloudOptions};
use mrol_logs::log::McapReader;
use mrol_logs::message::MessageKind;
use mrol_logs::survey::LogSurvey;
use mrol_map::geometry::Pose;

const CLOUD: &str = "sensor_msgs/msg/PointCloud2";
const TF: &str = "tf2_msgs/msg/TFMessage";

fn survey(log: &[u8]) -> LogSurvey {
    LogSurvey::take(&mut McapReader::new(log).unwrap(), |_| {}).unwrap()
}

/// A cloud of so many points of one byte, which is x, y and z.
fn cloud(stamp_ns: i64, frame: &str, points: usize) -> Vec<u8> {
    let mut writer = CdrWriter::new(false);
    writer.header(stamp_ns, frame);
    writer.u32(1);
    writer.u32(points as u32);
    writer.u32(3);
    for name in ["x", "y", "z"] {
        writer.string(name);
        writer.u32(0);
        writer.u8(2);
        writer.u32(1);
    }
    writer.u8(0);
    writer.u32(1);
    writer.u32(points as u32);
    writer.octets(&vec![1; points]);
    writer.u8(1);
    writer.finish()
}

#[test]
fn names_of_frames_that_are_too_long_are_neither_kept_nor_printed() {
    let long = "n".repeat(100_000);
    let mut log = McapWriter::default();
    let topics = ["/a", "/b"].map(|name| log.topic(name, CLOUD));
    let odometry_topics = ["/c", "/d"].map(|name| log.topic(name, "nav_msgs/msg/Odometry"));
    let tf = log.topic("/tf", TF);
    log.message(topics[0], 0, &cloud(0, &long, 1));
    log.message(topics[1], 0, &cloud(0, "lidar", 1));
    log.message(odometry_topics[0], 0, &odometry(0, &long, "base", &Pose::identity()));
    log.message(odometry_topics[1], 0, &odometry(0, "odom", &long, &Pose::identity()));
    let nowhere = Pose::translation(f64::NAN, 0.0, 0.0);
    log.message(tf, 0, &transforms(0, &[(&long, &long, nowhere)]));
    let survey = survey(&log.finish());
    for summary in &survey.topics {
        for name in [&summary.frame, &summary.child_frame].into_iter().flatten() {
            assert!(name.len() <= 256, "{}: {} bytes", summary.topic.name, name.len());
        }
        let is_told = summary.unreadable.as_ref().is_some_and(|why| why.contains("100000"));
        assert_eq!(is_told, ["/a", "/c", "/d"].contains(&&*summary.topic.name), "{summary:?}");
    }
    assert_eq!(survey.refused_transforms.len(), 1);
    assert!(survey.refused_transforms[0].len() < 400, "{} bytes", survey.refused_transforms[0].len());
}

#[test]
fn clouds_of_more_points_than_a_server_takes_and_frames_that_no_terminal_may_be_shown_are_told() {
    let read = |points: usize| {
        Cloud::read(MessageKind::PointCloud2, &cloud(0, "lidar", points), CloudOptions::default())
    };
    assert_eq!(read(2_000_000).unwrap().points.len(), 2_000_000);
    assert_eq!(read(2_000_001), Err(CloudError::TooMany { points: 2_000_001, max: 2_000_000 }));
    let mut log = McapWriter::default();
    let topic = log.topic("/a", CLOUD);
    log.message(topic, 0, &cloud(0, "\x1b[2Jlidar", 1));
    let survey = survey(&log.finish());
    assert_eq!(survey.topics[0].frame, None);
    assert!(survey.topics[0].unreadable.as_ref().is_some_and(|why| why.contains("control characters")));
}
