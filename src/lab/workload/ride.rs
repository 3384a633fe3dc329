//! What a spinning sensor sees on its way.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use super::Queries;
use crate::geometry::{Pose, translation_m};
use crate::lab::simulate::gaussian;

/// Lasers, one above the other.
const RINGS: usize = 64;
/// Shots of each in a turn.
const AZIMUTHS: usize = 1024;

/// How a sensor sees a surface.
pub(super) struct Sight {
    /// Elevations of its lowest and its highest ring.
    pub(super) elevation_deg: (f64, f64),
    /// Standard deviation of a range.
    pub(super) noise_m: f64,
}

/// Something to be seen.
pub(super) trait Surface {
    /// How it is seen.
    const SIGHT: Sight;

    /// Where the sensor is at its `turn`-th turn, map_from_sensor.
    fn sensor(&self, turn: usize) -> Pose;

    /// How far it is from a place along a direction of length one; none where nothing is met.
    fn range_m(&self, from: [f64; 3], direction: [f64; 3]) -> Option<f64>;
}

/// The first `count` points that a ride sees: turn after turn, azimuth after azimuth, ring above ring. As scans are
/// that one client gathered, all are in one frame.
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

/// More turns than are needed where at least one ray in thirty meets the surface, so that a ride ends even where none
/// does.
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
