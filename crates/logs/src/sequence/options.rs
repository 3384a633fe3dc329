//! Which scans of a log are taken.

use crate::point_times::TimesOption;
use mrol_map::geometry::Pose;

/// Which scans of a log are taken, and how they are read.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceOptions {
    /// How the times of points are read; found out where nobody says.
    pub times: Option<TimesOption>,
    /// What is added to the stamp of a cloud to have the time of its odometry, nanoseconds.
    pub time_offset_ns: i64,
    /// Where the sensor is on the frame that odometry tells of: base_from_sensor.
    pub extrinsics: Option<Pose>,
    /// Clouds that are so long after the first or longer are taken, nanoseconds.
    pub from_ns: i64,
    /// Clouds that are so long after the first or shorter are taken, nanoseconds.
    pub to_ns: i64,
    /// Of so many clouds, the first is taken; at least 1.
    pub every: u64,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            times: None,
            time_offset_ns: 0,
            extrinsics: None,
            from_ns: i64::MIN,
            to_ns: i64::MAX,
            every: 1,
        }
    }
}
