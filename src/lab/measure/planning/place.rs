//! Where bodies are put: near the surfaces of a map.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

use crate::geometry::{Pose, rotation_xyzw, translation_m};
use crate::map::MultiResolutionMap;
use crate::planning::{Body, Link, PlanningError, Sphere};

/// Voxels that stand for all.
const SAMPLE: usize = 50_000;
/// How far from a surface bodies are put, meters.
const NEAR_M: f64 = 1.0;

/// Places on the surfaces of a map, meters.
pub(super) struct Surface(Vec<[f64; 3]>);

impl Surface {
    pub(super) fn of(map: &MultiResolutionMap, random: &mut ChaCha8Rng) -> Self {
        let view = map.view();
        let total = view.lists(0).map(|list| list.len()).sum::<usize>().max(1);
        let mut places = Vec::new();
        for list in view.lists(0) {
            let wish = (SAMPLE * list.len()).div_ceil(total);
            let sample = list.sample(wish, random);
            places.extend(sample.into_iter().map(|voxel| map.lattice().center_m(voxel, 0)));
        }
        Self(places)
    }

    /// A place within a meter of a surface.
    pub(super) fn near(&self, random: &mut ChaCha8Rng) -> [f64; 3] {
        let place = self.0.choose(random).copied().unwrap_or_default();
        let off = in_ball(NEAR_M, random);
        std::array::from_fn(|axis| place[axis] + off[axis])
    }

    /// A motion of a body that stands upright: two poses `length_m` apart, in one plane, with a turn of up to 30 degrees.
    pub(super) fn motion(&self, length_m: f64, random: &mut ChaCha8Rng) -> Vec<f32> {
        let from = Vector3::from(self.near(random));
        let (heading, turn) = (random.random_range(-3.0f64..3.0), random.random_range(-0.5..0.5));
        let to = from + Vector3::new(heading.cos(), heading.sin(), 0.0) * length_m;
        let mut numbers = Vec::new();
        for (place, yaw) in [(from, heading), (to, heading + turn)] {
            let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
            append(&mut numbers, &Pose::from_parts(Translation3::from(place), rotation));
        }
        numbers
    }
}

/// A point of a ball about the origin.
pub(super) fn in_ball(radius: f64, random: &mut ChaCha8Rng) -> [f64; 3] {
    loop {
        let point = [0; 3].map(|_| random.random_range(-radius..radius));
        if point.iter().map(|c| c * c).sum::<f64>() <= radius * radius {
            return point;
        }
    }
}

/// Appends a pose as a configuration has it.
pub(super) fn append(numbers: &mut Vec<f32>, pose: &Pose) {
    numbers.extend(translation_m(pose).iter().chain(&rotation_xyzw(pose)).map(|c| *c as f32));
}

/// A body that moves on a floor: 20 spheres of 6 to 10 cm that fill a cart of 0.7 x 0.4 x 0.4 m.
pub(super) fn cart() -> Result<Body, PlanningError> {
    let sphere = |n: usize| {
        let at = |i: usize, count: usize, size: f32| size * (i as f32 / (count - 1) as f32 - 0.5);
        let center_m = [at(n % 5, 5, 0.56), at(n / 5 % 2, 2, 0.2), at(n / 10, 2, 0.2)];
        Sphere { center_m, radius_m: 0.06 + 0.01 * (n % 5) as f32 }
    };
    Body::new(vec![Link { spheres: (0..20).map(sphere).collect(), ..Link::default() }])
}
