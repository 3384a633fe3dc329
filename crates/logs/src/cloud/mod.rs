//! Clouds: the points of a message, whichever driver wrote it, with the raw times of points.

mod camera;
mod error;
mod field_column;
mod from_depth_image;
mod from_laser_scan;
mod from_livox;
mod from_point_cloud2;
mod raw_cloud;

pub use camera::{Camera, NoCamera};
pub use error::CloudError;
pub(crate) use from_depth_image::is_depth;
pub use from_point_cloud2::TIME_FIELDS;
pub use raw_cloud::{Cloud, CloudOptions, POINTS_MAX, RawTimes, TimeValues};
