//! Messages without points.

use super::CdrWriter;
use mrol_map::geometry::{Pose, rotation_xyzw, translation_m};

fn pose(writer: &mut CdrWriter, pose: &Pose) {
    translation_m(pose).into_iter().chain(rotation_xyzw(pose)).for_each(|number| writer.f64(number));
}

/// A `tf2_msgs/TFMessage` of (parent, child, parent_from_child), all of one time.
pub(crate) fn transforms(stamp_ns: i64, all: &[(&str, &str, Pose)]) -> Vec<u8> {
    let mut writer = CdrWriter::new(false);
    writer.u32(all.len() as u32);
    for (parent, child, parent_from_child) in all {
        writer.header(stamp_ns, parent);
        writer.string(child);
        pose(&mut writer, parent_from_child);
    }
    writer.finish()
}

/// A `nav_msgs/Odometry`.
pub(crate) fn odometry(stamp_ns: i64, frame: &str, child: &str, frame_from_child: &Pose) -> Vec<u8> {
    let mut writer = CdrWriter::new(false);
    writer.header(stamp_ns, frame);
    writer.string(child);
    pose(&mut writer, frame_from_child);
    // Its covariance, the twist, and that one's covariance.
    (0..36 + 6 + 36).for_each(|_| writer.f64(0.0));
    writer.finish()
}

/// A `sensor_msgs/Imu`.
pub(crate) fn imu(stamp_ns: i64, frame: &str, acceleration: [f64; 3]) -> Vec<u8> {
    let mut writer = CdrWriter::new(false);
    writer.header(stamp_ns, frame);
    (0..4 + 9 + 3 + 9).for_each(|_| writer.f64(0.0));
    acceleration.into_iter().for_each(|number| writer.f64(number));
    (0..9).for_each(|_| writer.f64(0.0));
    writer.finish()
}
