//! The depth camera.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use super::beam::{cast, drops_out, gaussian, point};
use crate::scene::Scene;
use mrol_map::geometry::{Point, Pose};

/// A depth camera; its frame has x to the right, y down and z forward.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthCamera {
    /// Pixels of a row.
    pub width_px: u32,
    /// Pixels of a column.
    pub height_px: u32,
    /// Angle across a row, degrees.
    pub horizontal_fov_deg: f64,
    /// Angle across a column, degrees.
    pub vertical_fov_deg: f64,
    /// Least depth (z) that it measures, meters.
    pub range_min_m: f64,
    /// Largest depth (z) that it measures, meters.
    pub range_max_m: f64,
    /// Standard deviation of the depth at one meter, meters; it grows with the depth squared.
    pub noise_at_1m_m: f64,
    /// Share of the returns that are lost.
    pub dropout: f64,
}

impl Default for DepthCamera {
    /// 160 x 120 pixels, 69 x 54 degrees, 0.3 to 6 m, noise of 1.5 mm at 1 m, 2 % of the returns lost.
    fn default() -> Self {
        Self {
            width_px: 160,
            height_px: 120,
            horizontal_fov_deg: 69.0,
            vertical_fov_deg: 54.0,
            range_min_m: 0.3,
            range_max_m: 6.0,
            noise_at_1m_m: 0.0015,
            dropout: 0.02,
        }
    }
}

impl DepthCamera {
    /// One scan in the sensor frame, meters: a point for each pixel, row by row, NaN where nothing returned.
    pub fn scan(&self, scene: &Scene, map_from_sensor: &Pose, rng: &mut ChaCha8Rng) -> Vec<Point> {
        let rows = (0..self.height_px).map(|row| tangent(row, self.height_px, self.vertical_fov_deg));
        let pixels = rows.flat_map(|y| {
            (0..self.width_px).map(move |column| {
                // With z = 1, distance along the direction is depth.
                Vector3::new(tangent(column, self.width_px, self.horizontal_fov_deg), y, 1.0)
            })
        });
        pixels.map(|direction| self.measure(direction, scene, map_from_sensor, rng)).collect()
    }

    fn measure(&self, direction: Vector3<f64>, scene: &Scene, pose: &Pose, rng: &mut ChaCha8Rng) -> Point {
        let depth = cast(scene, pose, direction, (self.range_min_m, self.range_max_m));
        let depth = depth.filter(|_| !drops_out(self.dropout, rng));
        point(direction, depth.map(|depth| depth + self.noise_at_1m_m * depth * depth * gaussian(rng)))
    }
}

/// Where the center of pixel `index` of `count`, which see `fov_deg` together, lies on the plane at z = 1.
fn tangent(index: u32, count: u32, fov_deg: f64) -> f64 {
    let half = (fov_deg / 2.0).to_radians().tan();
    ((f64::from(index) + 0.5) / f64::from(count) * 2.0 - 1.0) * half
}
