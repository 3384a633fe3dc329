//! What counts as an obstacle, by blocks: occupied voxels, and where unknown ones count, all that are not free.

use hashbrown::HashMap;

use super::free_space::FreeSpace;
use super::surroundings::Unknown;
use crate::map::MapView;
use crate::voxel::{BLOCK_LEVELS, BlockMask, INDEX_MAX, INDEX_MIN, VoxelKey};

/// The obstacles of a view, as the clearance field is made of them.
#[derive(Debug)]
pub(super) struct Obstacles<'a> {
    view: &'a MapView<'a>,
    /// Where unknown voxels count: what was seen through, and the blocks that were looked at, since the blocks around ask for
    /// each of them again.
    careful: Option<(FreeSpace<'a>, HashMap<(u32, VoxelKey), BlockMask>)>,
}

impl<'a> Obstacles<'a> {
    pub(super) fn of(view: &'a MapView<'a>, unknown: Unknown) -> Self {
        let careful = (unknown == Unknown::Occupied).then(|| (FreeSpace::of(view), HashMap::new()));
        Self { view, careful }
    }

    /// The voxels of `level` in `block` that count.
    pub(super) fn block(&mut self, level: u32, block: VoxelKey) -> BlockMask {
        let occupied = self.view.level_block(level, block);
        match &mut self.careful {
            Some((free_space, known)) if is_in_lattice(level, block) => {
                *known.entry((level, block)).or_insert_with(|| free_space.not_free(level, block, &occupied))
            }
            _ => occupied,
        }
    }
}

/// True where a block of voxels of `level` is one of the map's lattice: beyond there is nothing, unknown or not.
fn is_in_lattice(level: u32, block: VoxelKey) -> bool {
    let shift = level + BLOCK_LEVELS;
    block.index().iter().all(|i| (INDEX_MIN >> shift..=INDEX_MAX >> shift).contains(i))
}
