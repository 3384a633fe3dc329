//! The answer: what each ray met.

use crate::map::KeepOutName;
use crate::voxel::VoxelKey;

/// What rays met.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RayHits {
    /// Whether ray i met a voxel or a keep-out: bit i % 64 of `hit[i / 64]`.
    pub hit: Vec<u64>,
    /// From the origin to where the ray enters the cube of the voxel or the keep-out, meters; 0 where it begins in it,
    /// infinite where it met none.
    pub distances_m: Vec<f32>,
    /// The voxel, of the level that was asked; of a ray that met none, the voxel of index 0 0 0, and of one
    /// that met a keep-out too.
    pub voxels: Vec<VoxelKey>,
    /// The keep-out of each ray that met one instead of a voxel; empty where no ray did.
    pub keep_outs: Vec<Option<KeepOutName>>,
}

impl RayHits {
    /// No hit of any of so many rays.
    pub(super) fn none_of(rays: usize) -> Self {
        Self {
            hit: vec![0; rays.div_ceil(64)],
            distances_m: vec![f32::INFINITY; rays],
            voxels: vec![VoxelKey::default(); rays],
            keep_outs: Vec::new(),
        }
    }

    /// Takes the answers of those that follow; it has those of whole words of bits itself.
    pub fn append(&mut self, mut next: Self) {
        debug_assert!(self.len().is_multiple_of(64), "bits begin with a word");
        let (before, after) = (self.len(), self.len() + next.len());
        if !(self.keep_outs.is_empty() && next.keep_outs.is_empty()) {
            self.keep_outs.resize(before, None);
            self.keep_outs.append(&mut next.keep_outs);
            self.keep_outs.resize(after, None);
        }
        self.hit.append(&mut next.hit);
        self.distances_m.append(&mut next.distances_m);
        self.voxels.append(&mut next.voxels);
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.distances_m.len()
    }

    /// True without a ray.
    pub fn is_empty(&self) -> bool {
        self.distances_m.is_empty()
    }

    /// Number of rays that met a voxel.
    pub fn hits(&self) -> usize {
        self.hit.iter().map(|word| word.count_ones() as usize).sum()
    }

    #[inline(always)]
    pub(super) fn set(&mut self, ray: usize, distance_m: f64, voxel: VoxelKey) {
        self.hit[ray / 64] |= 1 << (ray % 64);
        self.distances_m[ray] = distance_m as f32;
        self.voxels[ray] = voxel;
    }
}
