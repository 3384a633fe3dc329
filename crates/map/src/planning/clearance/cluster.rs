//! Clusters of 8 x 8 x 8 blocks of the field: which are made, and where they are.

use super::block::{BLOCK_BYTES, FieldBlock, LINE_BYTES};
use crate::voxel::{BlockMask, VoxelKey};

/// Levels from a block up to its cluster.
pub(super) const CLUSTER_LEVELS: u32 = 3;
const BLOCKS: usize = 1 << (3 * CLUSTER_LEVELS);
/// The number of the block with nothing near.
const NOTHING_NEAR: u16 = 0;
/// No block has this number.
const UNMADE: u16 = u16::MAX;

/// The blocks of a cluster that were made.
#[derive(Debug)]
pub(super) struct FieldCluster {
    /// The number of each block of the cluster, x fastest.
    numbers: [u16; BLOCKS],
    /// The first is that with nothing near.
    blocks: Vec<FieldBlock>,
    /// Numbers of blocks that were forgotten.
    free: Vec<u16>,
}

impl FieldCluster {
    pub(super) fn new() -> Self {
        Self { numbers: [UNMADE; BLOCKS], blocks: vec![FieldBlock::FAR], free: Vec::new() }
    }

    /// The place of a block in its cluster.
    pub(super) fn place(block: VoxelKey) -> usize {
        let [x, y, z] = block.index().map(|i| (i & 7) as usize);
        x | y << 3 | z << 6
    }

    /// The byte of a cell of a block, both by their places; none where the block is not made.
    #[inline(always)]
    pub(super) fn byte(&self, block: u32, cell: u32) -> Option<&u8> {
        let number = self.numbers[block as usize % BLOCKS];
        self.blocks.get(usize::from(number)).map(|block| &block.0[cell as usize % BLOCK_BYTES])
    }

    /// The bytes of a line, by the places of its block and of a cell in it; none where the block is not made.
    #[inline(always)]
    pub(super) fn line(&self, block: u32, cell: u32) -> Option<&[u8; LINE_BYTES]> {
        let number = self.numbers[block as usize % BLOCKS];
        let lines = self.blocks.get(usize::from(number))?.0.as_chunks().0;
        lines.get(cell as usize / LINE_BYTES)
    }

    /// The obstacles in the block at `place`; none where it is not made.
    pub(super) fn obstacles(&self, place: usize) -> Option<BlockMask> {
        match self.numbers[place] {
            NOTHING_NEAR => Some(BlockMask::EMPTY),
            number => self.blocks.get(usize::from(number)).map(FieldBlock::obstacles),
        }
    }

    /// Keeps the block at `place`; none is one with nothing near.
    pub(super) fn set(&mut self, place: usize, block: Option<FieldBlock>) {
        self.forget(place);
        self.numbers[place] = match (block, self.free.pop()) {
            (None, free) => {
                self.free.extend(free);
                NOTHING_NEAR
            }
            (Some(block), Some(number)) => {
                self.blocks[usize::from(number)] = block;
                number
            }
            (Some(block), None) => {
                if self.blocks.len() == self.blocks.capacity() {
                    // By a quarter, not to hold much that is not used.
                    self.blocks.reserve_exact(self.blocks.len() / 4 + 4);
                }
                self.blocks.push(block);
                (self.blocks.len() - 1) as u16
            }
        };
    }

    /// Forgets the block at `place`.
    pub(super) fn forget(&mut self, place: usize) {
        let number = std::mem::replace(&mut self.numbers[place], UNMADE);
        if number != UNMADE && number != NOTHING_NEAR {
            self.free.push(number);
        }
    }

    /// Bytes of memory held, with room for the numbers of all blocks that may be forgotten.
    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>() + self.blocks.capacity() * BLOCK_BYTES + BLOCKS * size_of::<u16>()
    }
}
