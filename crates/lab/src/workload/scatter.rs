//! The workload of randomly generated voxels.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::queries::Queries;
use mrol_map::geometry::Pose;
use mrol_map::voxel::{VoxelKey, VoxelSet};

/// Random voxels of 5 cm in 14 x 9 x 3 m: "a map consisting of randomly generated voxels" (paper IV-A).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scatter {
    voxels: usize,
    seed: u64,
}

/// Number of voxels along the sides.
const SIZE: [i32; 3] = [280, 180, 60];

impl Scatter {
    /// Side of the voxels, meters.
    pub const RESOLUTION_M: f64 = 0.05;
    /// Number of voxels of the paper's map of real scans (IV).
    pub const VOXELS: usize = 142_812;
    /// Most voxels: half of the volume.
    pub const VOXELS_MAX: usize = (SIZE[0] * SIZE[1] * SIZE[2] / 2) as usize;

    /// Makes `voxels` voxels, at most [`Scatter::VOXELS_MAX`].
    pub fn of(voxels: usize, seed: u64) -> Self {
        Self { voxels: voxels.min(Self::VOXELS_MAX), seed }
    }

    /// A place in the middle of the voxels.
    pub(super) fn middle() -> Pose {
        let [x, y, z] = SIZE.map(|size| f64::from(size) * Self::RESOLUTION_M / 2.0);
        Pose::translation(x, y, z)
    }

    pub(super) fn voxels(self) -> VoxelSet {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut keys = hashbrown::HashSet::new();
        while keys.len() < self.voxels {
            keys.extend(VoxelKey::new(SIZE.map(|size| random.random_range(0..size))));
        }
        keys.into_iter().collect()
    }

    pub(super) fn random_queries(self, count: usize, random: &mut ChaCha8Rng) -> Queries {
        let size_m = SIZE.map(|size| f64::from(size) * Self::RESOLUTION_M);
        let anywhere = |_| size_m.map(|size_m| random.random_range(0.0..size_m));
        Queries::of_map_points((0..count).map(anywhere))
    }
}
