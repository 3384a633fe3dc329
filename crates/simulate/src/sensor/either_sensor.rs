//! [`Sensor`]: a depth camera or a spinning lidar.

use rand_chacha::ChaCha8Rng;

use super::camera::DepthCamera;
use super::lidar::SpinningLidar;
use crate::scene::Scene;
use mrol_map::geometry::{Point, Pose};

/// Either sensor.
#[derive(Debug, Clone, PartialEq)]
pub enum Sensor {
    /// A depth camera.
    DepthCamera(DepthCamera),
    /// A spinning lidar.
    SpinningLidar(SpinningLidar),
}

impl Sensor {
    /// One scan in the sensor frame, meters; see the sensor's own `scan`.
    pub fn scan(&self, scene: &Scene, map_from_sensor: &Pose, rng: &mut ChaCha8Rng) -> Vec<Point> {
        match self {
            Self::DepthCamera(camera) => camera.scan(scene, map_from_sensor, rng),
            Self::SpinningLidar(lidar) => lidar.scan(scene, map_from_sensor, rng),
        }
    }
}
