//! The voxels of one level, copied out of the map.

use crate::map::regions::VoxelSelection;
use crate::map::shards::tier_of;
use crate::map::view::MapView;
use crate::util::StopSignal;
use crate::voxel::{BLOCKS_PER_STOP_CHECK, BlockMask, VoxelKey};

/// A block with at least so many voxels is copied as it is stored, one with fewer voxel by voxel: whichever is smaller.
const VOXELS_OF_BLOCK_MIN: usize = size_of::<(VoxelKey, BlockMask)>() / size_of::<VoxelKey>();

/// The occupied voxels of one level, some or all of them, at one revision.
///
/// It is a copy of the map's blocks, 8 bytes a voxel at most and some 1 byte of a surface: taking it is short, so that
/// changes need not wait for a long listing that is made of it.
#[derive(Debug)]
pub struct LevelVoxels {
    /// Levels up in the blocks.
    up: u32,
    blocks: Vec<(VoxelKey, BlockMask)>,
    /// Keys of the voxels of blocks with a few voxels.
    voxels: Vec<VoxelKey>,
    len: usize,
}

impl LevelVoxels {
    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without a voxel.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Hands out the voxels, in no order, some at a time; once stopped, some of them.
    pub fn for_some(self, stop: StopSignal<'_>, mut f: impl FnMut(&[VoxelKey])) {
        const SOME: usize = 4096;
        self.voxels.chunks(SOME).for_each(&mut f);
        let mut some = Vec::with_capacity(2 * SOME);
        for (block, mask) in stop.paced(self.blocks.iter(), BLOCKS_PER_STOP_CHECK) {
            some.extend(mask.cells(self.up).map(|cell| cell.voxel(*block).ancestor(self.up)));
            if some.len() >= SOME {
                f(&some);
                some.clear();
            }
        }
        f(&some);
    }

    fn push(&mut self, block: VoxelKey, mask: &BlockMask) {
        let voxels = mask.count(self.up);
        self.len += voxels;
        if voxels >= VOXELS_OF_BLOCK_MIN {
            self.blocks.push((block, *mask));
        } else {
            self.voxels.extend(mask.cells(self.up).map(|cell| cell.voxel(block).ancestor(self.up)));
        }
    }
}

impl MapView<'_> {
    /// Copies the selected voxels of `level`. Looks at `stop` and at `most` shard by shard: where it ends early for one
    /// of them the copy is not whole, and longer than `most` for the latter.
    pub fn level_voxels(
        &self,
        level: u32,
        selection: &VoxelSelection,
        most: usize,
        stop: StopSignal<'_>,
    ) -> LevelVoxels {
        let (_, up) = tier_of(level);
        let mut copy = LevelVoxels { up, blocks: Vec::new(), voxels: Vec::new(), len: 0 };
        for list in self.lists(level) {
            if stop.is_stopped() || copy.len > most {
                break;
            }
            self.for_each_block(&list, selection, stop, |block, mask| {
                copy.push(block, &self.part_in(selection, level, block, mask));
            });
        }
        copy
    }

    /// Number of selected voxels of `level`; once stopped, of some of them.
    pub fn count_voxels(&self, level: u32, selection: &VoxelSelection, stop: StopSignal<'_>) -> usize {
        if selection.is_everything() {
            return self.lists(level).map(|list| list.len()).sum();
        }
        let (_, up) = tier_of(level);
        let mut count = 0;
        for list in self.lists(level) {
            self.for_each_block(&list, selection, stop, |block, mask| {
                count += self.part_in(selection, level, block, mask).count(up);
            });
        }
        count
    }
}
