//! Simulated sensors: what they measure in a scene, with noise and missing returns.

mod beam;
mod camera;
mod either_sensor;
mod lidar;
#[cfg(test)]
mod tests;

pub use beam::gaussian;
pub use camera::DepthCamera;
pub use either_sensor::Sensor;
pub use lidar::SpinningLidar;
