//! Which message a type name means.

/// A message that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MessageKind {
    /// `sensor_msgs/PointCloud2`.
    PointCloud2,
    /// `CustomMsg` of `livox_ros_driver2`, or of its sibling for ROS 1, which has the same fields.
    Livox,
    /// `sensor_msgs/LaserScan`.
    LaserScan,
    /// `sensor_msgs/Image`, which has points where its pixels are depths.
    Image,
    /// `sensor_msgs/CameraInfo`.
    CameraInfo,
    /// `tf2_msgs/TFMessage`.
    Transforms,
    /// `nav_msgs/Odometry`.
    Odometry,
    /// `sensor_msgs/Imu`.
    Imu,
}

impl MessageKind {
    /// The message of a type, named as ROS 2 does, `sensor_msgs/msg/Imu`, or as ROS 1 did, `sensor_msgs/Imu`.
    pub fn of_type(name: &str) -> Option<Self> {
        let (package, message) = name.split_once('/')?;
        let message = message.strip_prefix("msg/").unwrap_or(message);
        Some(match (package, message) {
            ("sensor_msgs", "PointCloud2") => Self::PointCloud2,
            ("livox_ros_driver2" | "livox_ros_driver", "CustomMsg") => Self::Livox,
            ("sensor_msgs", "LaserScan") => Self::LaserScan,
            ("sensor_msgs", "Image") => Self::Image,
            ("sensor_msgs", "CameraInfo") => Self::CameraInfo,
            ("tf2_msgs" | "tf", "TFMessage" | "tfMessage") => Self::Transforms,
            ("nav_msgs", "Odometry") => Self::Odometry,
            ("sensor_msgs", "Imu") => Self::Imu,
            _ => return None,
        })
    }

    /// True of messages that may have points.
    pub fn is_cloud(self) -> bool {
        matches!(self, Self::PointCloud2 | Self::Livox | Self::LaserScan | Self::Image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_known_by_the_names_of_both_generations() {
        for name in ["sensor_msgs/msg/PointCloud2", "sensor_msgs/PointCloud2"] {
            assert_eq!(MessageKind::of_type(name), Some(MessageKind::PointCloud2));
        }
        for name in ["livox_ros_driver2/msg/CustomMsg", "livox_ros_driver/msg/CustomMsg"] {
            assert_eq!(MessageKind::of_type(name), Some(MessageKind::Livox));
        }
        assert_eq!(MessageKind::of_type("tf2_msgs/msg/TFMessage"), Some(MessageKind::Transforms));
        for name in ["sensor_msgs/msg/CompressedImage", "PointCloud2", "", "sensor_msgs/msg/msg/Imu"] {
            assert_eq!(MessageKind::of_type(name), None, "{name}");
        }
    }
}
