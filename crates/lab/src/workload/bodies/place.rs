//! Where bodies are put: near the surfaces of a map.

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

use mrol_map::geometry::{Pose, rotation_xyzw, translation_m};
use mrol_map::map::MultiResolutionMap;

/// Voxels that stand for all.
const SAMPLE: usize = 50_000;
/// How far from a surface bodies are put, meters.
const NEAR_M: f64 = 1.0;

/// Places on the surfaces of a map, meters.
pub(crate) struct Surface(Vec<[f64; 3]>);

impl Surface {
    /// Some of the places, spread over all surfaces.
    pub(crate) fn of(map: &MultiResolutionMap, random: &mut ChaCha8Rng) -> Self {
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
    pub(crate) fn near(&self, random: &mut ChaCha8Rng) -> [f64; 3] {
        let place = self.0.choose(random).copied().unwrap_or_default();
        let off = in_ball(NEAR_M, random);
        std::array::from_fn(|axis| place[axis] + off[axis])
    }
}

/// A point of a ball about the origin.
pub(crate) fn in_ball(radius: f64, random: &mut ChaCha8Rng) -> [f64; 3] {
    loop {
        let point = [0; 3].map(|_| random.random_range(-radius..radius));
        if point.iter().map(|c| c * c).sum::<f64>() <= radius * radius {
            return point;
        }
    }
}

/// Appends a pose as a configuration has it.
pub(crate) fn append(numbers: &mut Vec<f32>, pose: &Pose) {
    numbers.extend(translation_m(pose).iter().chain(&rotation_xyzw(pose)).map(|c| *c as f32));
}
