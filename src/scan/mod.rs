//! Scans: point clouds and trajectories in files, and simulated sensors in a simulated building.
//!
//! A scan is a `Vec<Point>` in its sensor's frame, metres; a point with a NaN or infinite coordinate means "no
//! return", and readers and sensors alike keep it.

mod point_filter;
mod reader;
mod ride;
mod route;
mod scene;
mod sensor;
mod tour;
mod tum;
mod writer;

pub use point_filter::{PointFilter, PointFilterError};
pub use reader::{ReadError, parse_points, read_points, scan_files};
pub use scene::Scene;
#[cfg(feature = "server")]
pub(crate) use sensor::gaussian;
pub use sensor::{DepthCamera, Sensor, SpinningLidar};
pub use tour::{Tour, tours};
pub use tum::{StampedPose, parse_trajectory, read_trajectory, write_trajectory};
pub use writer::{write_f32, write_ply};
