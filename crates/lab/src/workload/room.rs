//! The workload of a room.

use nalgebra::{Translation3, UnitQuaternion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::queries::Queries;
use super::ride::{Sight, Surface};
use mrol_map::geometry::Pose;
use mrol_map::voxel::{VoxelKey, VoxelSet};

/// A room: floor, ceiling and walls of 14 x 9 x 3 m, one voxel thick. It has 155 thousand voxels of 5 cm, as many as
/// the paper's largest map. Its center is the origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room;

/// Half of the room's sides, voxels.
const HALF: [i32; 3] = [140, 90, 30];
/// Half axes of the sensor's path, an ellipse around the room's center, meters.
const WAY_M: [f64; 2] = [4.5, 2.5];
/// Distance that the sensor moves in a revolution, meters.
const TURN_M: f64 = 0.1;

impl Room {
    /// Side of the room's voxels, meters.
    pub const RESOLUTION_M: f64 = 0.05;

    pub(super) fn voxels(self) -> VoxelSet {
        self.indices().filter_map(VoxelKey::new).collect()
    }

    /// Indices of the room's voxels, row by row.
    pub(super) fn indices(self) -> impl Iterator<Item = [i32; 3]> {
        let [nx, ny, nz] = HALF.map(|half| 2 * half);
        let index = move |n: i32| [n % nx - HALF[0], n / nx % ny - HALF[1], n / (nx * ny) - HALF[2]];
        let is_surface = |index: &[i32; 3]| (0..3).any(|k| index[k] == -HALF[k] || index[k] == HALF[k] - 1);
        (0..nx * ny * nz).map(index).filter(is_surface)
    }

    pub(super) fn random_queries(self, count: usize, random: &mut ChaCha8Rng) -> Queries {
        let anywhere = |_| half_m().map(|half_m| random.random_range(-half_m..half_m));
        Queries::of_map_points((0..count).map(anywhere))
    }
}

fn half_m() -> [f64; 3] {
    HALF.map(|half| f64::from(half) * Room::RESOLUTION_M)
}

impl Surface for Room {
    const SIGHT: Sight = Sight { elevation_deg: (-22.5, 22.5), noise_m: 0.01 };

    fn sensor(&self, turn: usize) -> Pose {
        let angle = turn as f64 * TURN_M / WAY_M[0];
        let place = Translation3::new(WAY_M[0] * angle.cos(), WAY_M[1] * angle.sin(), -0.3);
        Pose::from_parts(place, UnitQuaternion::from_euler_angles(0.02, -0.03, angle))
    }

    /// The walls are hit in the middle of their voxels.
    fn range_m(&self, from: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let to_wall = |k: usize| {
            let wall = half_m()[k] - Self::RESOLUTION_M / 2.0;
            (wall.copysign(direction[k]) - from[k]) / direction[k]
        };
        let nearest = (0..3).filter(|&k| direction[k] != 0.0).map(to_wall).fold(f64::INFINITY, f64::min);
        nearest.is_finite().then_some(nearest)
    }
}
