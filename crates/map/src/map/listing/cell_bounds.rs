//! How far a map goes, without a look at its finest blocks.

use crate::map::shards::tier_of;
use crate::map::view::MapView;
use crate::voxel::{BLOCK_LEVELS, INDEX_MAX, INDEX_MIN};

/// A box of cells: the first cell, and the one past the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CellBounds {
    pub(crate) first: [i32; 3],
    pub(crate) end: [i32; 3],
}

impl MapView<'_> {
    /// The box of all cells of the tier that serves `level`, whether something is there or not.
    pub(crate) fn lattice_bounds(&self, level: u32) -> CellBounds {
        let finer = tier_of(level).0 as u32 * BLOCK_LEVELS;
        CellBounds { first: [INDEX_MIN >> finer; 3], end: [(INDEX_MAX >> finer) + 1; 3] }
    }

    /// A box around all voxels that the view covers, in cells of the tier that serves `level`: as small as whole blocks
    /// of the coarsest tier allow. None without a voxel.
    pub(crate) fn cell_bounds(&self, level: u32) -> Option<CellBounds> {
        let coarsest = self.lattice().levels() - 1;
        let tiers_up = tier_of(coarsest).0 - tier_of(level).0;
        let block_levels = (tiers_up as u32 + 1) * BLOCK_LEVELS;
        let mut blocks =
            self.lists(coarsest).flat_map(|list| list.blocks().iter().map(|(block, _)| block.index()));
        let first = blocks.next()?;
        let (mut low, mut high) = (first, first);
        for index in blocks {
            for axis in 0..3 {
                low[axis] = low[axis].min(index[axis]);
                high[axis] = high[axis].max(index[axis]);
            }
        }
        Some(CellBounds { first: low.map(|i| i << block_levels), end: high.map(|i| (i + 1) << block_levels) })
    }
}
