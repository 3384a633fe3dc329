//! The points of a message.

use super::camera::Camera;
use super::error::CloudError;
use crate::message::{FieldType, Image, LaserScan, LivoxCloud, MessageKind, PointCloud2};
use mrol_map::geometry::Point;

/// Points of a cloud, at most: as many as a server takes of a scan by default.
pub const POINTS_MAX: usize = 2_000_000;

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

/// What has to be known to read a cloud, besides its message.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CloudOptions<'a> {
    /// The field of the times of points; where none, the first that is [known](super::TIME_FIELDS) to have some.
    pub time_field: Option<&'a str>,
    /// The camera of depth images.
    pub camera: Option<&'a Camera>,
}

impl Cloud {
    /// The cloud of a message of a kind [that has one](MessageKind::is_cloud).
    ///
    /// # Errors
    /// When the message is cut off, its fields do not lie within its data, it has more than [`POINTS_MAX`] points, or
    /// is an image without depths or without a camera.
    pub fn read(kind: MessageKind, message: &[u8], options: CloudOptions<'_>) -> Result<Self, CloudError> {
        match kind {
            MessageKind::PointCloud2 => {
                Self::of_point_cloud2(&PointCloud2::read(message)?, options.time_field)
            }
            MessageKind::Image => {
                let image = Image::read(message)?;
                Self::of_depth_image(&image, options.camera.ok_or(CloudError::NoCamera)?)
            }
            MessageKind::Livox => {
                let cloud = LivoxCloud::read(message)?;
                check_points(cloud.points.len())?;
                Ok(Self::of_livox(&cloud))
            }
            MessageKind::LaserScan => {
                let scan = LaserScan::read(message)?;
                check_points(scan.ranges_m.len())?;
                Ok(Self::of_laser_scan(&scan))
            }
            MessageKind::CameraInfo | MessageKind::Transforms | MessageKind::Odometry | MessageKind::Imu => {
                Err(CloudError::NoCloud)
            }
        }
    }
}

/// Refuses a cloud of so many points, if that is too many: points of a byte each would take forty times their message.
pub(super) fn check_points(points: usize) -> Result<(), CloudError> {
    if points > POINTS_MAX { Err(CloudError::TooMany { points, max: POINTS_MAX }) } else { Ok(()) }
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
