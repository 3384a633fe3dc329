//! Space as a ray sees it: occupied, or empty up to some size.

use super::ray::Ray;
use crate::map::{CellBounds, TierView};
use crate::voxel::{BLOCK_LEVELS, BlockInCluster, Cell, Cluster, VoxelKey};

/// Clusters that are remembered, each axis a power of two of them: neighboring rays meet the same ones.
const REMEMBERED: [u32; 3] = [3, 3, 2];

/// The voxels of one level, with the clusters that were met last.
pub(super) struct Space<'a> {
    view: TierView<'a>,
    bounds: CellBounds,
    up: u32,
    piece_levels: u32,
    remembered: Vec<(VoxelKey, Option<&'a Cluster>)>,
}

impl<'a> Space<'a> {
    /// Space without a voxel beyond `bounds`.
    pub(super) fn new(view: TierView<'a>, bounds: CellBounds) -> Self {
        let (up, piece_levels) = (view.up(), view.piece_levels());
        // No piece has the key of one beyond where indices end.
        let none = (VoxelKey::default(), None);
        let mut space = Self {
            view,
            bounds,
            up,
            piece_levels,
            remembered: vec![none; 1 << REMEMBERED.iter().sum::<u32>()],
        };
        space.remembered[0].1 = space.view.cluster_around([0; 3]);
        space
    }

    /// The first occupied voxel that the ray meets before `range_m`: where it is met, and its key.
    #[inline]
    pub(super) fn first_hit(&mut self, ray: &Ray, range_m: f64) -> Option<(f64, VoxelKey)> {
        let (mut place, end_m) = ray.clipped(&self.bounds, range_m)?;
        loop {
            let cell = ray.turn(place.cell);
            let Some(levels) = self.empty_levels(cell) else {
                return Some((place.at_m, VoxelKey::pack(cell.map(|i| i >> self.up))));
            };
            place = ray.beyond(place.cell, levels);
            if !(place.at_m < end_m) {
                return None;
            }
        }
    }

    /// How large the empty aligned cube around `cell` is: the levels from a cell up to it. None where the voxel that holds
    /// the cell is occupied.
    #[inline(always)]
    fn empty_levels(&mut self, cell: [i32; 3]) -> Option<u32> {
        let Some(cluster) = self.cluster(cell) else { return Some(self.piece_levels) };
        let place = BlockInCluster::of_voxel(cell);
        let levels = match cluster.empty_levels(place) {
            Some(levels) => BLOCK_LEVELS + levels,
            None => cluster.get(place).empty_levels(Cell::of(cell).1, self.up)?,
        };
        Some(levels.min(self.piece_levels))
    }

    #[inline(always)]
    fn cluster(&mut self, cell: [i32; 3]) -> Option<&'a Cluster> {
        let piece = cell.map(|i| i >> self.piece_levels);
        let key = VoxelKey::pack(piece);
        let [x, y, z]: [usize; 3] =
            std::array::from_fn(|axis| (piece[axis] & ((1 << REMEMBERED[axis]) - 1)) as usize);
        let slot = &mut self.remembered[x | y << REMEMBERED[0] | z << (REMEMBERED[0] + REMEMBERED[1])];
        if slot.0 != key {
            *slot = (key, self.view.cluster_around(cell));
        }
        slot.1
    }
}
