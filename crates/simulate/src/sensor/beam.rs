//! One beam of a sensor: its return, its point and its noise.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::scene::Scene;
use mrol_map::geometry::{Point, Pose};

/// Distance along `direction` (sensor frame) to the first surface, when it lies within `range`: from, to.
pub(super) fn cast(
    scene: &Scene,
    map_from_sensor: &Pose,
    direction: Vector3<f64>,
    range: (f64, f64),
) -> Option<f64> {
    let origin = Point3::from(map_from_sensor.translation.vector);
    scene.cast(origin, map_from_sensor.rotation * direction, range.1).filter(|distance| *distance >= range.0)
}

/// The point at `distance` along `direction`; NaN without a return.
pub(super) fn point(direction: Vector3<f64>, distance: Option<f64>) -> Point {
    Point::from(Point3::from(direction * distance.unwrap_or(f64::NAN)))
}

/// True for a share of `dropout` of all calls.
pub(super) fn drops_out(dropout: f64, rng: &mut ChaCha8Rng) -> bool {
    rng.random::<f64>() < dropout
}

/// A number from the normal distribution of mean 0 and deviation 1, by Box and Muller.
pub fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    let (radius, angle): (f64, f64) = (rng.random(), rng.random());
    // 1 - radius lies in (0, 1], where the logarithm is finite.
    (-2.0 * (1.0 - radius).ln()).sqrt() * (TAU * angle).cos()
}
