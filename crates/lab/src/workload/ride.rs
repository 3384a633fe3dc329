//! Simulation of a spinning sensor that moves through a workload.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use super::queries::Queries;
use mrol_map::geometry::{Pose, translation_m};
use mrol_simulate::gaussian;

/// Number of lasers, one above the other.
const RINGS: usize = 64;
/// Number of shots of each laser in a revolution.
const AZIMUTHS: usize = 1024;

/// Properties of the sensor for a surface.
pub(super) struct Sight {
    /// Elevations of the lowest and the highest ring, degrees.
    pub(super) elevation_deg: (f64, f64),
    /// Standard deviation of a range, meters.
    pub(super) noise_m: f64,
}

/// A surface that a ray can hit.
pub(super) trait Surface {
    /// Properties of the sensor.
    const SIGHT: Sight;

    /// Pose of the sensor in revolution `turn`, map_from_sensor.
    fn sensor(&self, turn: usize) -> Pose;

    /// Distance from the point `from` to the surface along the unit vector `direction`, meters; none where the ray
    /// misses.
    fn range_m(&self, from: [f64; 3], direction: [f64; 3]) -> Option<f64>;
}

/// The first `count` points of a ride: revolution after revolution, azimuth after azimuth, ring after ring. All are in
/// one frame, as if one client had gathered the scans.
pub(super) fn queries<S: Surface>(surface: &S, count: usize, random: &mut ChaCha8Rng) -> Queries {
    let turns = 0..turns_max(count);
    let shots = turns.flat_map(|turn| {
        let map_from_sensor = surface.sensor(turn);
        let rays =
            (0..AZIMUTHS).flat_map(|azimuth| (0..RINGS).map(move |ring| direction::<S>(azimuth, ring)));
        rays.map(move |direction| (translation_m(&map_from_sensor), map_from_sensor.rotation * direction))
    });
    let seen = shots.filter_map(|(from, direction)| {
        let range_m = surface.range_m(from, direction.into())? + S::SIGHT.noise_m * gaussian(random);
        Some(std::array::from_fn(|k| from[k] + range_m * direction[k]))
    });
    Queries::of_map_points(seen.take(count))
}

/// Limit on the revolutions, enough where at least one ray in thirty hits the surface, so that a ride ends even where
/// none does.
fn turns_max(count: usize) -> usize {
    count * 30 / (RINGS * AZIMUTHS) + 1
}

fn direction<S: Surface>(azimuth: usize, ring: usize) -> Vector3<f64> {
    let (low, high) = S::SIGHT.elevation_deg;
    let elevation_deg = low + (high - low) * ring as f64 / (RINGS - 1) as f64;
    let (sin, cos) = (azimuth as f64 / AZIMUTHS as f64 * TAU).sin_cos();
    let (up, along) = elevation_deg.to_radians().sin_cos();
    Vector3::new(cos * along, sin * along, up)
}
