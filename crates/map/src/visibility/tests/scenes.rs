//! Scenes and poses of the tests.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::{SurfaceSettings, Sweep, Thresholds};
use crate::geometry::{Point, Pose};

pub(super) const RANGE: Sweep = Sweep::standing(40.0);
pub(super) const SURFACE: SurfaceSettings = SurfaceSettings {
    grazing_rad: 0.14,
    noise_m: 0.05,
    spacing_m: 0.1,
    sensor: None,
    thresholds: Thresholds::DEFAULT,
};

/// A scan from the middle of a room of 6 x 4 x 3 m, seen through a window of directions.
pub(super) fn room(random: &mut ChaCha8Rng, points: usize, around: f32) -> Vec<Point> {
    let half = [3.0f32, 2.0, 1.5];
    let mut point = || {
        let direction = [1.0, random.random_range(-around..around), random.random_range(-around..around)];
        let to_wall = (0..3).map(|axis| half[axis] / f32::abs(direction[axis])).fold(f32::INFINITY, f32::min);
        Point::from(direction.map(|c| c * to_wall))
    };
    (0..points).map(|_| point()).collect()
}

pub(super) fn any_pose(random: &mut ChaCha8Rng, spread_m: f64) -> Pose {
    let mut any = || random.random_range(-1.0..1.0);
    let translation = nalgebra::Translation3::new(any() * spread_m, any() * spread_m, any() * spread_m);
    let rotation = nalgebra::UnitQuaternion::from_euler_angles(any() * 3.0, any() * 1.5, any() * 3.0);
    Pose::from_parts(translation, rotation)
}

/// The ends of rays in all directions of a window (degrees to each side and up), as `range_m` says how far each goes.
pub(super) fn window(
    side_deg: f64,
    up_deg: f64,
    step_deg: f64,
    range_m: impl Fn([f64; 3]) -> f64,
) -> Vec<Point> {
    let steps = |deg: f64| (2.0 * deg / step_deg).round() as usize;
    let ray = |(i, j): (usize, usize)| {
        let azimuth = (i as f64 * step_deg - side_deg).to_radians();
        let elevation = (j as f64 * step_deg - up_deg).to_radians();
        let direction = [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
        Point::from(direction.map(|c| (c * range_m(direction)) as f32))
    };
    let rays = (0..=steps(side_deg)).flat_map(|i| (0..=steps(up_deg)).map(move |j| (i, j)));
    rays.map(ray).collect()
}
