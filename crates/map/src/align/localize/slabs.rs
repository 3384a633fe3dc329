//! Slabs: how the voxels of a map are distributed along each axis.

use super::supervision::{Unbuilt, check};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, VoxelKey};

/// A box of finest voxels, inclusive.
pub(super) type VoxelBox = ([i32; 3], [i32; 3]);

/// Blocks that are counted between two checks of the stop signal.
pub(super) const BLOCKS_PER_STOP_CHECK: usize = 16 << 10;

/// Number of finest voxels in each slab of blocks, axis by axis.
#[derive(Debug)]
pub(super) struct Slabs {
    /// Index of the first slab.
    first: [i32; 3],
    counts: [Vec<usize>; 3],
    voxels: usize,
}

impl Slabs {
    /// Counts the slabs of the blocks of a map, of which there is at least one.
    pub(super) fn of(blocks: &[(VoxelKey, BlockMask)], stop: StopSignal<'_>) -> Result<Self, Unbuilt> {
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for blocks in blocks.chunks(BLOCKS_PER_STOP_CHECK) {
            check(stop)?;
            for (block, _) in blocks {
                let index = block.index();
                low = std::array::from_fn(|axis| low[axis].min(index[axis]));
                high = std::array::from_fn(|axis| high[axis].max(index[axis]));
            }
        }
        let slabs = |axis: usize| vec![0; (high[axis] - low[axis] + 1).max(0) as usize];
        let mut counted = Self { first: low, counts: std::array::from_fn(slabs), voxels: 0 };
        for blocks in blocks.chunks(BLOCKS_PER_STOP_CHECK) {
            check(stop)?;
            for (block, mask) in blocks {
                let (index, count) = (block.index(), mask.count(0));
                counted.voxels += count;
                for axis in 0..3 {
                    counted.counts[axis][(index[axis] - low[axis]) as usize] += count;
                }
            }
        }
        Ok(counted)
    }

    /// Box of all blocks, without those that hold the outermost `stray` share of the voxels at each end of each axis.
    pub(super) fn bounds(&self, stray: f64) -> Option<VoxelBox> {
        let strays = (self.voxels as f64 * stray) as usize;
        let (mut low, mut high) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            let (first, counts) = (self.first[axis], &self.counts[axis]);
            let last = counts.len() as i32 - 1;
            low[axis] = (first + first_beyond(strays, counts.iter())?) << BLOCK_LEVELS;
            let from_last = first_beyond(strays, counts.iter().rev())?;
            high[axis] = ((first + last - from_last) << BLOCK_LEVELS) + BLOCK_SIDE - 1;
        }
        Some((low, high))
    }
}

/// Index of the slab in which the running total first exceeds `strays`.
fn first_beyond<'a>(strays: usize, counts: impl Iterator<Item = &'a usize>) -> Option<i32> {
    let mut passed = 0;
    let mut beyond = counts.map(|count| {
        passed += count;
        passed > strays
    });
    beyond.position(|beyond| beyond).map(|place| place as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::VoxelSet;

    #[test]
    fn the_bounds_leave_out_as_many_strays_as_asked_at_each_end() {
        let voxel = |x: i32| VoxelKey::new([x, -x, 3]).unwrap();
        let voxels: VoxelSet = (0..80).chain([-800, 4000]).map(voxel).collect();
        let slabs = Slabs::of(voxels.blocks(), StopSignal::NEVER).unwrap();
        assert_eq!(slabs.bounds(0.0), Some(([-800, -4000, 0], [4007, 807, 7])));
        assert_eq!(slabs.bounds(0.02), Some(([0, -80, 0], [79, 7, 7])));
        assert_eq!(slabs.bounds(1.0), None);
    }
}
