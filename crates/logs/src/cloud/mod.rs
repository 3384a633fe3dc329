//! Clouds: the points of a message, whichever driver wrote it, with the raw times of points.

mod error;
mod field_column;
mod from_laser_scan;
mod from_livox;
mod from_point_cloud2;
mod raw_cloud;

pub use error::CloudError;
pub use from_point_cloud2::TIME_FIELDS;
pub use raw_cloud::{Cloud, POINTS_MAX, RawTimes, TimeValues};
