//! What counts as an obstacle, by blocks: occupied voxels, and where unknown ones count, all that are not free.

use hashbrown::HashMap;

use super::free_space::{ALL, FreeSpace};
use super::surroundings::Unknown;
use crate::map::MapView;
use crate::voxel::{BLOCK_LEVELS, BlockMask, INDEX_MAX, INDEX_MIN, VoxelKey};

/// What was seen through, by level and block.
pub(in crate::planning) type SeenBlocks = HashMap<(u32, VoxelKey), BlockMask>;

/// The obstacles of a view, as the clearance field is made of them.
#[derive(Debug)]
pub(in crate::planning) struct Obstacles<'a> {
    view: &'a MapView<'a>,
    /// Where unknown voxels count.
    free_space: Option<FreeSpace<'a>>,
    /// The blocks that were looked at: each is asked for again by those around it.
    seen: SeenBlocks,
}

impl<'a> Obstacles<'a> {
    /// The obstacles of a view, of which it is known what was seen through in some blocks.
    pub(in crate::planning) fn of(view: &'a MapView<'a>, unknown: Unknown, seen: SeenBlocks) -> Self {
        let free_space = (unknown == Unknown::Occupied).then(|| FreeSpace::of(view));
        Self { view, free_space, seen }
    }

    /// The voxels of `level` in `block` that count.
    pub(in crate::planning) fn block(&mut self, level: u32, block: VoxelKey) -> BlockMask {
        let occupied = self.view.level_block(level, block);
        let Some(free_space) = self.free_space.as_ref().filter(|_| is_in_lattice(level, block)) else {
            return occupied;
        };
        let look = || free_space.seen_through(level, block, &BlockMask::EMPTY);
        let seen = self.seen.entry((level, block)).or_insert_with(look);
        ALL.difference(&seen.difference(&occupied))
    }

    /// What was seen through in the blocks that were looked at.
    pub(in crate::planning) fn into_seen(self) -> SeenBlocks {
        self.seen
    }
}

/// True where a block of voxels of `level` is one of the map's lattice: beyond there is nothing, unknown or not.
fn is_in_lattice(level: u32, block: VoxelKey) -> bool {
    let shift = level + BLOCK_LEVELS;
    block.index().iter().all(|i| (INDEX_MIN >> shift..=INDEX_MAX >> shift).contains(i))
}
