//! A scan of a log.

use mrol_map::align::localize::Gravity;
use mrol_map::geometry::{Point, Pose};

/// A scan of a log, ready for the mapper.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedScan {
    /// Its cloud's own stamp, nanoseconds since the Unix epoch; not when it was recorded.
    pub stamp_ns: i64,
    /// In the sensor frame, meters; not finite where nothing returned.
    pub points: Vec<Point>,
    /// When each point was measured, seconds from the stamp; NaN of points that are no returns. None where the log does
    /// not say.
    pub times_s: Option<Vec<f32>>,
    /// Where the sensor was by its odometry: odometry_from_sensor.
    pub odometry_from_sensor: Option<Pose>,
    /// Direction of gravity in the sensor frame, while the accelerometer reads 1 g.
    pub gravity: Option<Gravity>,
}

/// A first pose by odometry that is farther from the origin is not taken, meters: those of satellites are.
const FIRST_POSE_MAX_M: f64 = 1000.0;

impl LoggedScan {
    /// Where a map that begins with this scan has it, so that the map lies as the odometry's frame: by the odometry;
    /// none far from its origin.
    pub fn first_pose(&self) -> Option<Pose> {
        self.odometry_from_sensor.filter(|pose| pose.translation.vector.norm() <= FIRST_POSE_MAX_M)
    }
}
