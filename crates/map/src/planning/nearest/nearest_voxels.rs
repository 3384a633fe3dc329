//! The answer: the nearest voxel of each point.

use crate::map::KeepOutName;
use crate::voxel::VoxelKey;

/// The nearest voxel of each point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NearestVoxels {
    /// Whether there is a voxel or a keep-out within the radius of point i: bit i % 64 of `found[i / 64]`.
    pub found: Vec<u64>,
    /// Distance to it, meters; infinite where there is none.
    pub distances_m: Vec<f32>,
    /// The voxel; where there is none or a keep-out is nearer, the voxel of index 0 0 0.
    pub voxels: Vec<VoxelKey>,
    /// The unit vector from the nearest place of the voxel to the point, x y z: the way on which the distance grows
    /// fastest. Zero where the distance is, and where there is no voxel.
    pub away: Vec<[f32; 3]>,
    /// The keep-out of each point to which one is nearer than all voxels; empty where there is no such point.
    pub keep_outs: Vec<Option<KeepOutName>>,
}

/// The nearest voxel of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearest {
    pub(super) distance_m: f64,
    pub(super) voxel: VoxelKey,
    pub(super) away: [f64; 3],
}

impl NearestVoxels {
    pub(super) fn of_capacity(points: usize) -> Self {
        Self {
            found: vec![0; points.div_ceil(64)],
            distances_m: Vec::with_capacity(points),
            voxels: Vec::with_capacity(points),
            away: Vec::with_capacity(points),
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
        self.found.append(&mut next.found);
        self.distances_m.append(&mut next.distances_m);
        self.voxels.append(&mut next.voxels);
        self.away.append(&mut next.away);
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.distances_m.len()
    }

    /// True without a point.
    pub fn is_empty(&self) -> bool {
        self.distances_m.is_empty()
    }

    /// Number of points with a voxel within the radius.
    pub fn count(&self) -> usize {
        self.found.iter().map(|word| word.count_ones() as usize).sum()
    }

    pub(super) fn set(&mut self, at: usize, Nearest { distance_m, voxel, away }: Nearest) {
        self.found[at / 64] |= 1 << (at % 64);
        (self.distances_m[at], self.voxels[at]) = (distance_m as f32, voxel);
        self.away[at] = away.map(|c| c as f32);
    }

    pub(super) fn push(&mut self, nearest: Option<Nearest>) {
        let at = self.len();
        self.found[at / 64] |= u64::from(nearest.is_some()) << (at % 64);
        let none = Nearest { distance_m: f64::INFINITY, voxel: VoxelKey::default(), away: [0.0; 3] };
        let Nearest { distance_m, voxel, away } = nearest.unwrap_or(none);
        self.distances_m.push(distance_m as f32);
        self.voxels.push(voxel);
        self.away.push(away.map(|c| c as f32));
    }
}
