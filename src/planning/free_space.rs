//! Free space: generated on demand from where scans saw through (paper III-B), voxel by voxel of any level.

use crate::map::MapView;
use crate::visibility::{Gaze, ViewpointSet};
use crate::voxel::{BlockMask, Cell, Lattice, VoxelKey};

/// Cells of a block.
pub(super) const CELLS: u16 = 512;
/// All voxels of a block.
pub(super) const ALL: BlockMask = BlockMask([u64::MAX; 8]);

/// What the scans of a map saw through, as they are asked about one voxel after the other.
///
/// A voxel of a level was seen through where a viewpoint saw beyond its center. It is free where nothing occupies it as well.
#[derive(Debug, Clone)]
pub(super) struct FreeSpace<'a> {
    lattice: &'a Lattice,
    /// None where the view has no viewpoints: nothing was seen through.
    gaze: Option<Gaze<'a>>,
}

impl<'a> FreeSpace<'a> {
    /// What the scans of a view's map saw through.
    pub(super) fn of(view: &'a MapView<'_>) -> Self {
        let viewpoints = view.viewpoints().filter(|viewpoints| !viewpoints.is_empty());
        Self { lattice: view.lattice(), gaze: viewpoints.map(|viewpoints| ViewpointSet::gaze(viewpoints)) }
    }

    /// True where a scan saw through the center of `voxel` of `level`.
    #[inline]
    pub(super) fn is_seen_through(&mut self, voxel: VoxelKey, level: u32) -> bool {
        let center_m = self.lattice.center_m(voxel, level);
        self.gaze.as_mut().is_some_and(|gaze| gaze.sees_through(center_m))
    }

    /// The voxels of `level` in `block` that are not free, where those of `occupied` are occupied.
    pub(super) fn not_free(&mut self, level: u32, block: VoxelKey, occupied: &BlockMask) -> BlockMask {
        ALL.difference(&self.seen_through(level, block, occupied))
    }

    /// The voxels of `level` in `block` that were seen through, but for those of `but`.
    pub(super) fn seen_through(&mut self, level: u32, block: VoxelKey, but: &BlockMask) -> BlockMask {
        let mut seen = BlockMask::EMPTY;
        if self.gaze.is_some() {
            for cell in (0..CELLS).map(Cell::from_bits).filter(|cell| !but.contains(*cell, 0)) {
                if self.is_seen_through(cell.voxel(block), level) {
                    seen.insert(cell);
                }
            }
        }
        seen
    }
}
