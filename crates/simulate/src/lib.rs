//! Simulated sensors in a simulated building.
//!
//! A scan is a `Vec<Point>` in its sensor's frame, meters, as in [`mrol_map::scan`]; a beam without a return is a point
//! with NaN coordinates.

mod ride;
mod route;
mod scene;
mod sensor;
mod tour;

pub use scene::{Mover, Scene};
pub use sensor::gaussian;
pub use sensor::{DepthCamera, Sensor, SpinningLidar};
pub use tour::{LIDAR_LAP_M, Tour, lidar_at, tours};
