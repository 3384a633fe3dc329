//! From the points of a scan to images of it: how densely they lie, what is between them, and which gaps rays leave.

mod density;
mod nearest_depths;
mod of_points;
mod ray_gaps;
mod scan_image;
mod scan_rays;
mod sensor_model;
mod sensor_rays;
mod sweep;

pub(super) use density::PointDensity;
pub use scan_image::ScanImage;
pub use scan_rays::ScanRays;
pub use sensor_model::{SensorModel, SensorModelError};
pub use sensor_rays::{SensorMismatch, SensorRays};
pub use sweep::Sweep;
