//! What a change does to each block.

use crate::voxel::{BlockMask, VoxelKey, VoxelSet};

/// What a change does to a block: voxels go first, where they are there, and then voxels come.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockChange<'a> {
    pub(super) block: VoxelKey,
    pub(super) removed: &'a BlockMask,
    pub(super) added: &'a BlockMask,
}

/// The changes, in ascending order of their blocks, by which the voxels of `removed` go and those of `added` come.
pub(super) fn block_changes<'a>(
    removed: &'a VoxelSet,
    added: &'a VoxelSet,
) -> impl Iterator<Item = BlockChange<'a>> {
    let (mut removed, mut added) = (removed.blocks().iter().peekable(), added.blocks().iter().peekable());
    std::iter::from_fn(move || {
        let next = match (removed.peek(), added.peek()) {
            (Some((one, _)), Some((other, _))) => *one.min(other),
            (Some((block, _)), None) | (None, Some((block, _))) => *block,
            (None, None) => return None,
        };
        let removed =
            removed.next_if(|(block, _)| *block == next).map_or(&BlockMask::EMPTY, |(_, mask)| mask);
        let added = added.next_if(|(block, _)| *block == next).map_or(&BlockMask::EMPTY, |(_, mask)| mask);
        Some(BlockChange { block: next, removed, added })
    })
}
