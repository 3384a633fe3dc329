//! The points of a message.

use super::error::CloudError;
use crate::message::{FieldType, LaserScan, LivoxCloud, MessageKind, PointCloud2};
use mrol_map::geometry::Point;

/// The points of a message, in the order in which it has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    /// The message's own stamp, nanoseconds.
    pub stamp_ns: i64,
    /// The sensor's frame.
    pub frame: String,
    /// In the sensor frame, meters; not finite where nothing returned.
    pub points: Vec<Point>,
    /// When each was measured, as the driver wrote it; none where the message has no field for it.
    pub times: Option<RawTimes>,
    /// Which laser measured each; empty where the message does not say.
    pub rings: Vec<u16>,
}

/// The times of points as a driver wrote them.
#[derive(Debug, Clone, PartialEq)]
pub struct RawTimes {
    /// The name of the field.
    pub field: String,
    /// Its type.
    pub field_type: FieldType,
    /// One for each point.
    pub values: TimeValues,
}

/// Numbers of a field.
#[derive(Debug, Clone, PartialEq)]
pub enum TimeValues {
    /// Whole numbers, exactly.
    Integers(Vec<i64>),
    /// Others.
    Floats(Vec<f64>),
}

impl Cloud {
    /// The cloud of a message of a kind [that has one](MessageKind::is_cloud); its times are those of `time_field`, or
    /// of the first field that is [known](super::TIME_FIELDS) to have some.
    ///
    /// # Errors
    /// When the message is cut off, or its fields do not lie within its data.
    pub fn read(kind: MessageKind, message: &[u8], time_field: Option<&str>) -> Result<Self, CloudError> {
        match kind {
            MessageKind::PointCloud2 => Self::of_point_cloud2(&PointCloud2::read(message)?, time_field),
            MessageKind::Livox => Ok(Self::of_livox(&LivoxCloud::read(message)?)),
            MessageKind::LaserScan => Ok(Self::of_laser_scan(&LaserScan::read(message)?)),
            MessageKind::Transforms | MessageKind::Odometry | MessageKind::Imu => Err(CloudError::NoCloud),
        }
    }
}

impl TimeValues {
    /// Number of times.
    pub fn len(&self) -> usize {
        match self {
            Self::Integers(values) => values.len(),
            Self::Floats(values) => values.len(),
        }
    }

    /// True without a time.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
