//! What a user says of a log.

use crate::point_times::TimesOption;
use mrol_map::geometry::Pose;

/// What a user says of a log; all of it is found out where nobody says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Choice {
    /// The topic of clouds.
    pub cloud: Option<String>,
    /// The topic of odometry, or the frame that the robot moves in; `none`: neither.
    pub odometry: Option<String>,
    /// Where the sensor is on the frame that odometry tells of: base_from_sensor.
    pub extrinsics: Option<Pose>,
    /// How the times of points are read.
    pub times: Option<TimesOption>,
}

/// Why a log cannot be mapped as it was asked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChoiceError {
    /// The log has no clouds.
    #[error(
        "the log has no topic with clouds: sensor_msgs/PointCloud2, LaserScan, Image of depths, and Livox's CustomMsg \
         in cdr are read; it has {0}"
    )]
    NoClouds(String),
    /// There is no such topic of clouds.
    #[error("the log has no clouds at {asked:?}, but at {there}")]
    NoSuchCloud {
        /// What was asked for.
        asked: String,
        /// The topics that have some.
        there: String,
    },
    /// Depth images whose camera is not known.
    #[error("the depth images of {topic} cannot be read: {why}")]
    Camera {
        /// The topic.
        topic: String,
        /// Why.
        why: String,
    },
    /// There is neither a topic nor a frame of this name.
    #[error(
        "{asked:?} is neither a topic of nav_msgs/Odometry nor a frame above the sensor's; there are {there}"
    )]
    NoSuchOdometry {
        /// What was asked for.
        asked: String,
        /// What there is.
        there: String,
    },
    /// Odometry that was asked for by name, and cannot be used.
    #[error("the odometry {asked:?} cannot be used: {why}")]
    Odometry {
        /// What was asked for.
        asked: String,
        /// Why.
        why: String,
    },
}
