//! The messages of ROS 2 that tell of clouds, frames and motions, by their fields.
//!
//! Messages borrow from the bytes that they are read from.

mod camera_info;
mod header;
mod image;
mod imu;
mod kind;
mod laser_scan;
mod livox;
mod odometry;
mod point_cloud2;
mod transforms;

pub use camera_info::CameraInfo;
pub use header::Header;
pub use image::Image;
pub use imu::Imu;
pub use kind::MessageKind;
pub use laser_scan::LaserScan;
pub use livox::{LivoxCloud, LivoxPoint};
pub use odometry::Odometry;
pub use point_cloud2::{FieldType, PointCloud2, PointField};
pub use transforms::{StampedTransform, transforms};
