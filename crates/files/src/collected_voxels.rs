//! Voxels that come one by one, in any order.

use hashbrown::HashMap;

use mrol_map::voxel::{BlockMask, Cell, VoxelKey, VoxelSet};

/// Distinct finest voxels. Takes memory by the blocks that have one, however often they come.
#[derive(Debug, Default)]
pub(crate) struct CollectedVoxels {
    blocks: HashMap<VoxelKey, BlockMask>,
    /// The block of the last voxel: the next one is often in it too.
    last: Option<(VoxelKey, BlockMask)>,
}

impl CollectedVoxels {
    pub(crate) fn add(&mut self, voxel: VoxelKey) {
        let (block, cell) = Cell::of(voxel.index());
        match &mut self.last {
            Some((last, mask)) if *last == block => {
                mask.insert(cell);
            }
            _ => {
                let mut mask = BlockMask::default();
                mask.insert(cell);
                let last = self.last.replace((block, mask));
                last.into_iter().for_each(|(block, mask)| self.add_block(block, &mask));
            }
        }
    }

    /// Adds all finest voxels in a voxel of a level below that of blocks.
    pub(crate) fn add_cube(&mut self, voxel: VoxelKey, level: u32) {
        let side = 1 << level;
        let first = voxel.index().map(|i| i << level);
        for cell in 0..side * side * side {
            let offset = [cell % side, cell / side % side, cell / (side * side)];
            VoxelKey::new([0, 1, 2].map(|axis| first[axis] + offset[axis]))
                .into_iter()
                .for_each(|key| self.add(key));
        }
    }

    /// Adds all finest voxels in a cube of `2^levels` blocks a side, its indices counted in such cubes.
    pub(crate) fn add_blocks(&mut self, cube: VoxelKey, levels: u32) {
        let side = 1 << levels;
        let first = cube.index().map(|i| i << levels);
        let full = full_block();
        for (x, y, z) in
            (0..side).flat_map(|z| (0..side).flat_map(move |y| (0..side).map(move |x| (x, y, z))))
        {
            let block = VoxelKey::new([first[0] + x, first[1] + y, first[2] + z]);
            block.into_iter().for_each(|block| self.add_block(block, &full));
        }
    }

    pub(crate) fn add_block(&mut self, block: VoxelKey, added: &BlockMask) {
        let mask = self.blocks.entry(block).or_default();
        *mask = mask.union(added);
    }

    pub(crate) fn into_set(mut self) -> VoxelSet {
        let last = self.last.take();
        last.into_iter().for_each(|(block, mask)| self.add_block(block, &mask));
        self.blocks.into_iter().collect()
    }
}

fn full_block() -> BlockMask {
    BlockMask::from_le_bytes(&[u8::MAX; BlockMask::BYTES])
}
