//! The fields of all levels of a map: what is made, what is forgotten, and how much memory they may hold.

use std::collections::VecDeque;
use std::sync::Arc;

use super::block::FieldBlock;
use super::cluster::{CLUSTER_LEVELS, FieldCluster};
use super::level::FieldLevel;
use crate::map::{MapView, TouchedBlocks};
use crate::planning::unknown::{Obstacles, SeenBlocks, Unknown};
use crate::util::Keyword;
use crate::visibility::{Viewpoint, ViewpointSet};
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Lattice, VoxelKey};

/// Bytes of memory that the fields of a map hold at most where nobody says.
pub const FIELD_BYTES_MAX_DEFAULT: usize = 128 << 20;

/// Blocks that are forgotten one by one where viewpoints change; where there are more, all go that depend on
/// viewpoints.
const FORGOTTEN_BLOCKS_MAX: f64 = 200_000.0;

/// Bytes of memory of a block of which it is kept what was seen through.
const SEEN_BYTES: usize = 2 * size_of::<((u32, VoxelKey), BlockMask)>();
/// The share of the bytes that fields may hold that such blocks take at most, one in so many.
const SEEN_SHARE: usize = 4;

/// Cells beyond a change in which distances may change with it.
const NEAR_CELLS: i32 = 8;

/// A block of the field: what unknown voxels count as in it, its level and its key, three levels coarser.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::planning) struct FieldBlockKey {
    pub(in crate::planning) unknown: Unknown,
    pub(in crate::planning) level: u32,
    pub(in crate::planning) block: VoxelKey,
}

/// The fields of a map's levels, each made where it is asked for; one of each kind, for unknown voxels that are free
/// and for such that are occupied.
#[derive(Debug)]
pub(in crate::planning) struct Fields {
    levels: [Vec<FieldLevel>; Unknown::ALL.len()],
    /// What the fields depend on in which unknown voxels are occupied.
    viewpoints: Arc<ViewpointSet>,
    /// What these saw through, of blocks from which fields were made.
    seen: SeenBlocks,
    /// The clusters by age, the oldest first: that is the first to go.
    by_age: VecDeque<FieldBlockKey>,
    bytes: usize,
    bytes_max: usize,
}

impl Fields {
    /// Fields of `levels` levels, which hold `bytes_max` bytes at most, but for what one question needs at once.
    pub(in crate::planning) fn new(levels: u32, bytes_max: usize) -> Self {
        let fields = || std::iter::repeat_with(FieldLevel::default).take(levels as usize).collect();
        Self {
            levels: [fields(), fields()],
            viewpoints: Arc::default(),
            seen: SeenBlocks::new(),
            by_age: VecDeque::new(),
            bytes: 0,
            bytes_max,
        }
    }

    /// Bytes of memory held.
    pub(in crate::planning) fn bytes(&self) -> usize {
        self.bytes + self.seen.len() * SEEN_BYTES
    }

    /// The field of `level`.
    pub(in crate::planning) fn level(&self, unknown: Unknown, level: u32) -> &FieldLevel {
        &self.levels[unknown as usize][level as usize]
    }

    fn level_mut(&mut self, unknown: Unknown, level: u32) -> &mut FieldLevel {
        &mut self.levels[unknown as usize][level as usize]
    }

    /// Levels that have a field.
    fn levels(&self) -> u32 {
        self.levels[0].len() as u32
    }

    /// True where the fields in which unknown voxels are occupied are those of these viewpoints.
    pub(in crate::planning) fn are_of(&self, viewpoints: Option<&Arc<ViewpointSet>>) -> bool {
        viewpoints.is_some_and(|viewpoints| Arc::ptr_eq(viewpoints, &self.viewpoints))
    }

    /// Keeps blocks, and makes room for them where that is needed.
    pub(in crate::planning) fn keep(&mut self, blocks: Vec<(FieldBlockKey, Option<FieldBlock>)>) {
        for (key @ FieldBlockKey { unknown, level, block }, made) in blocks {
            let field = &mut self.levels[unknown as usize][level as usize];
            if field.cluster_mut(block).is_none() {
                field.add_cluster(block);
                self.by_age.push_back(FieldBlockKey { block: block.ancestor(CLUSTER_LEVELS), ..key });
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

    /// What is known of what was seen through around blocks that are to be made.
    pub(in crate::planning) fn seen_around(&self, blocks: &[FieldBlockKey]) -> SeenBlocks {
        let mut around = SeenBlocks::new();
        for key in blocks {
            for block in key.around().into_iter().flatten() {
                if let Some(seen) = self.seen.get(&(key.level, block)) {
                    around.insert((key.level, block), *seen);
                }
            }
        }
        around
    }

    /// Keeps what was seen through; where there is no room, forgets what was known before.
    pub(in crate::planning) fn keep_seen(&mut self, seen: SeenBlocks) {
        let most = self.bytes_max / SEEN_SHARE / SEEN_BYTES;
        if self.seen.len() + seen.len() > most {
            self.seen.clear();
        }
        if seen.len() <= most {
            self.seen.extend(seen);
        }
    }

    /// Drops the oldest clusters beyond the bound.
    fn make_room(&mut self) {
        while self.bytes() > self.bytes_max
            && let Some(FieldBlockKey { unknown, level, block }) = self.by_age.pop_front()
        {
            self.bytes -= self.level_mut(unknown, level).remove_cluster(block);
        }
    }

    /// Takes note of viewpoints, and forgets what those that came and went made untrue.
    pub(in crate::planning) fn see(&mut self, viewpoints: &Arc<ViewpointSet>, lattice: &Lattice) {
        let before = std::mem::replace(&mut self.viewpoints, Arc::clone(viewpoints));
        let fields = &self.levels[Unknown::Occupied as usize];
        let levels: Vec<u32> =
            (0..).zip(fields).filter(|(_, of)| !of.is_empty()).map(|(level, _)| level).collect();
        self.seen.retain(|(level, _), _| levels.contains(level));
        if levels.is_empty() {
            return;
        }
        let reaches: Vec<_> = changed(&before, viewpoints).flat_map(Viewpoint::boxes_m).collect();
        let boxes = |level: u32| {
            let cells_per_m = 1.0 / lattice.resolution_m(level);
            // One cell more, whatever the rounding; a conversion keeps to what a number can hold.
            let index = move |c: f64, more: f64| (c * cells_per_m + more).floor() as i32;
            reaches.iter().map(move |[low, high]| [low.map(|c| index(c, -1.0)), high.map(|c| index(c, 1.0))])
        };
        let blocks: f64 = levels.iter().flat_map(|level| boxes(*level)).map(blocks_near).sum();
        if blocks > FORGOTTEN_BLOCKS_MAX {
            return self.forget_seen();
        }
        for &level in &levels {
            for [low, high] in boxes(level) {
                self.forget_box_of(Unknown::Occupied, level, low, high);
                for block in blocks_within(low, high, 0) {
                    self.seen.remove(&(level, block));
                }
            }
        }
    }

    /// Forgets all that depends on viewpoints.
    fn forget_seen(&mut self) {
        self.seen.clear();
        let (gone, kept) = self.by_age.drain(..).partition(|key| key.unknown == Unknown::Occupied);
        self.by_age = kept;
        for FieldBlockKey { unknown, level, block } in gone {
            self.bytes -= self.level_mut(unknown, level).remove_cluster(block);
        }
    }

    /// Forgets what changes made untrue.
    pub(in crate::planning) fn forget(&mut self, touched: &TouchedBlocks, view: &MapView<'_>) {
        if touched.everything {
            let viewpoints = Arc::clone(&self.viewpoints);
            *self = Self { viewpoints, ..Self::new(self.levels(), self.bytes_max) };
            return;
        }
        let end = self.levels() - 1;
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
        if Unknown::ALL.iter().all(|unknown| self.level(*unknown, level).is_empty()) {
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
        for &unknown in Unknown::ALL {
            self.forget_box_of(unknown, level, low, high);
        }
    }

    fn forget_box_of(&mut self, unknown: Unknown, level: u32, low: [i32; 3], high: [i32; 3]) {
        let field = self.level_mut(unknown, level);
        if field.is_empty() {
            return;
        }
        blocks_within(low, high, NEAR_CELLS).for_each(|block| field.forget(block));
    }
}

/// The blocks within `more` cells of the cells from `low` to `high`.
fn blocks_within(low: [i32; 3], high: [i32; 3], more: i32) -> impl Iterator<Item = VoxelKey> {
    let range = move |axis: usize| {
        low[axis].saturating_sub(more) >> BLOCK_LEVELS..=high[axis].saturating_add(more) >> BLOCK_LEVELS
    };
    let rows = range(2).flat_map(move |z| range(1).map(move |y| (y, z)));
    rows.flat_map(move |(y, z)| range(0).filter_map(move |x| VoxelKey::new([x, y, z])))
}

/// The viewpoints that are in one of two sets alone.
fn changed<'a>(before: &'a ViewpointSet, now: &'a ViewpointSet) -> impl Iterator<Item = &'a Viewpoint> {
    let only = |one: &'a ViewpointSet, other: &'a ViewpointSet| {
        let is_other = |(revision, viewpoint): &(u64, &Arc<Viewpoint>)| {
            !other.get(*revision).is_some_and(|same| Arc::ptr_eq(same, viewpoint))
        };
        one.iter().filter(is_other).map(|(_, viewpoint)| &**viewpoint)
    };
    only(before, now).chain(only(now, before))
}

/// How many blocks lie within [`NEAR_CELLS`] of the cells of a box.
fn blocks_near([low, high]: [[i32; 3]; 2]) -> f64 {
    let along = |axis: usize| {
        (f64::from(high[axis]) - f64::from(low[axis]) + f64::from(2 * NEAR_CELLS)) / f64::from(BLOCK_SIDE)
            + 2.0
    };
    (0..3).map(along).product()
}

impl FieldBlockKey {
    /// Computes the block, of the obstacles around it.
    pub(in crate::planning) fn make(self, obstacles: &mut Obstacles<'_>) -> Option<FieldBlock> {
        let mut around = [BlockMask::EMPTY; 27];
        for (block, mask) in self.around().into_iter().zip(&mut around) {
            *mask = block.map_or(BlockMask::EMPTY, |block| obstacles.block(self.level, block));
        }
        around.iter().any(|mask| !mask.is_empty()).then(|| FieldBlock::of(&around)).flatten()
    }

    /// The blocks around it and itself, x fastest; none beyond all keys.
    fn around(self) -> [Option<VoxelKey>; 27] {
        let [x, y, z] = self.block.index();
        std::array::from_fn(|n| {
            let n = n as i32;
            VoxelKey::new([x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1])
        })
    }
}
