//! The fields of all levels of a map: what is made, what is forgotten, and how much memory they may hold.

use std::collections::VecDeque;

use super::block::FieldBlock;
use super::cluster::{CLUSTER_LEVELS, FieldCluster};
use super::level::FieldLevel;
use crate::map::{MapView, TouchedBlocks};
use crate::voxel::{BLOCK_LEVELS, BlockMask, VoxelKey};

/// Bytes of memory that the fields of a map hold at most where nobody says.
pub const FIELD_BYTES_MAX_DEFAULT: usize = 128 << 20;

/// Cells beyond a change in which distances may change with it.
const NEAR_CELLS: i32 = 8;

/// A block of the field: its level and its key, three levels coarser.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::planning) struct FieldBlockKey {
    pub(in crate::planning) level: u32,
    pub(in crate::planning) block: VoxelKey,
}

/// The fields of a map's levels, each made where it is asked for.
#[derive(Debug)]
pub(in crate::planning) struct Fields {
    levels: Vec<FieldLevel>,
    /// The clusters by age, the oldest first: that is the first to go.
    by_age: VecDeque<FieldBlockKey>,
    bytes: usize,
    bytes_max: usize,
}

impl Fields {
    /// Fields of `levels` levels, which hold `bytes_max` bytes at most, but for what one question needs at once.
    pub(in crate::planning) fn new(levels: u32, bytes_max: usize) -> Self {
        let levels = std::iter::repeat_with(FieldLevel::default).take(levels as usize).collect();
        Self { levels, by_age: VecDeque::new(), bytes: 0, bytes_max }
    }

    /// Bytes of memory held.
    pub(in crate::planning) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The field of `level`.
    pub(in crate::planning) fn level(&self, level: u32) -> &FieldLevel {
        &self.levels[level as usize]
    }

    /// Keeps blocks, and makes room for them where that is needed.
    pub(in crate::planning) fn keep(&mut self, blocks: Vec<(FieldBlockKey, Option<FieldBlock>)>) {
        for (FieldBlockKey { level, block }, made) in blocks {
            let field = &mut self.levels[level as usize];
            if field.cluster_mut(block).is_none() {
                field.add_cluster(block);
                self.by_age.push_back(FieldBlockKey { level, block: block.ancestor(CLUSTER_LEVELS) });
                self.bytes += FieldCluster::new().bytes();
            }
            if let Some(cluster) = field.cluster_mut(block) {
                let before = cluster.bytes();
                cluster.set(FieldCluster::place(block), made);
                self.bytes = self.bytes + cluster.bytes() - before;
            }
        }
        self.make_room();
    }

    /// Drops the oldest clusters beyond the bound.
    fn make_room(&mut self) {
        while self.bytes > self.bytes_max
            && let Some(FieldBlockKey { level, block }) = self.by_age.pop_front()
        {
            self.bytes -= self.levels[level as usize].remove_cluster(block);
        }
    }

    /// Forgets what changes made untrue.
    pub(in crate::planning) fn forget(&mut self, touched: &TouchedBlocks, view: &MapView<'_>) {
        if touched.everything {
            *self = Self::new(self.levels.len() as u32, self.bytes_max);
            return;
        }
        let end = self.levels.len() as u32 - 1;
        for (tier, blocks) in (0..).zip(&touched.tiers) {
            let finest = tier * BLOCK_LEVELS;
            for &(block, changed) in blocks {
                let now = view.level_block(finest, block);
                let before = now.symmetric_difference(&changed);
                for up in 0..BLOCK_LEVELS {
                    self.forget_near(finest + up, up, block, [&before, &now]);
                }
                if finest + BLOCK_LEVELS == end && before.is_empty() != now.is_empty() {
                    self.forget_box(end, block.index(), block.index());
                }
            }
        }
    }

    /// Forgets the blocks of `level` near the voxels that came or went, which are `up` levels coarser than those of a
    /// block before and after.
    fn forget_near(&mut self, level: u32, up: u32, block: VoxelKey, [before, after]: [&BlockMask; 2]) {
        if self.levels[level as usize].is_empty() {
            return;
        }
        let changed = before.symmetric_difference(after);
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for cell in changed.cells(up).filter(|&cell| before.contains(cell, up) != after.contains(cell, up)) {
            let index = cell.voxel(block).ancestor(up).index();
            low = std::array::from_fn(|axis| low[axis].min(index[axis]));
            high = std::array::from_fn(|axis| high[axis].max(index[axis]));
        }
        if low[0] <= high[0] {
            self.forget_box(level, low, high);
        }
    }

    /// Forgets the blocks within [`NEAR_CELLS`] of the cells from `low` to `high`.
    fn forget_box(&mut self, level: u32, low: [i32; 3], high: [i32; 3]) {
        if self.levels[level as usize].is_empty() {
            return;
        }
        let range = |axis: usize| {
            low[axis].saturating_sub(NEAR_CELLS) >> BLOCK_LEVELS
                ..=high[axis].saturating_add(NEAR_CELLS) >> BLOCK_LEVELS
        };
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    if let Some(block) = VoxelKey::new([x, y, z]) {
                        self.levels[level as usize].forget(block);
                    }
                }
            }
        }
    }
}

impl FieldBlockKey {
    /// Computes the block, of the voxels that the view shows.
    pub(in crate::planning) fn make(self, view: &MapView<'_>) -> Option<FieldBlock> {
        let [x, y, z] = self.block.index();
        let mut around = [BlockMask::EMPTY; 27];
        for (n, mask) in (0..).zip(&mut around) {
            let neighbor = VoxelKey::new([x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]);
            if let Some(neighbor) = neighbor {
                *mask = view.level_block(self.level, neighbor);
            }
        }
        around.iter().any(|mask| !mask.is_empty()).then(|| FieldBlock::of(&around)).flatten()
    }
}
