//! Free space: generated on demand from where scans saw through (paper III-B), voxel by voxel of any level.

use crate::map::MapView;
use crate::visibility::{ViewpointCache, ViewpointSet};
use crate::voxel::{BlockMask, Cell, Lattice, VoxelKey};

/// Cells of a block.
pub(in crate::planning) const CELLS: u16 = 512;
/// All voxels of a block.
pub(in crate::planning) const ALL: BlockMask = BlockMask([u64::MAX; 8]);

/// What the scans of a map saw through, as they are asked about one voxel after the other.
///
/// A voxel of a level was seen through where a viewpoint saw beyond its center. It is free where nothing occupies it as
/// well.
#[derive(Debug, Clone)]
pub(in crate::planning) struct FreeSpace<'a> {
    lattice: &'a Lattice,
    /// None where the view has no viewpoints: nothing was seen through.
    viewpoints: Option<&'a ViewpointSet>,
    cache: Option<ViewpointCache<'a>>,
}

impl<'a> FreeSpace<'a> {
    /// What the scans of a view's map saw through.
    pub(in crate::planning) fn of(view: &'a MapView<'_>) -> Self {
        let viewpoints = view.viewpoints().map(|viewpoints| &**viewpoints).filter(|all| !all.is_empty());
        Self { lattice: view.lattice(), viewpoints, cache: viewpoints.map(ViewpointSet::cache) }
    }

    /// True where a scan saw through the center of `voxel` of `level`.
    #[inline]
    pub(in crate::planning) fn is_seen_through(&mut self, voxel: VoxelKey, level: u32) -> bool {
        let center_m = self.lattice.center_m(voxel, level);
        self.cache.as_mut().is_some_and(|cache| cache.is_free(center_m))
    }

    /// The voxels of `level` in `block` that were seen through, but for those of `but`.
    pub(in crate::planning) fn seen_through(
        &self,
        level: u32,
        block: VoxelKey,
        but: &BlockMask,
    ) -> BlockMask {
        let mut seen = BlockMask::EMPTY;
        let Some(viewpoints) = self.viewpoints else { return seen };
        let mut left: Vec<(Cell, [f64; 3])> = (0..CELLS)
            .map(Cell::from_bits)
            .filter(|cell| !but.contains(*cell, 0))
            .map(|cell| (cell, self.lattice.center_m(cell.voxel(block), level)))
            .collect();
        // One viewpoint after the other, so that its image stays near at hand.
        let of_cell = |n: u16| self.lattice.center_m(Cell::from_bits(n).voxel(block), level);
        for viewpoint in viewpoints.within(of_cell(0), of_cell(CELLS - 1)) {
            left.retain(|(cell, center_m)| {
                let is_seen = viewpoint.is_free(*center_m);
                if is_seen {
                    seen.insert(*cell);
                }
                !is_seen
            });
            if left.is_empty() {
                break;
            }
        }
        seen
    }
}
