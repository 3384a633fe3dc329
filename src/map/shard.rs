//! All levels of one part of space.

use super::MapSettings;
use super::occupied_voxel_list::{OccupiedVoxelList, tier_of};
use crate::bloom::CountingBloomFilter;
use crate::voxel::{BLOCK_LEVELS, BlockMask, BlockTable, VoxelKey, VoxelSet};

/// Blocks and their voxels of one tier.
pub(super) type Blocks = [(VoxelKey, BlockMask)];

/// The occupied voxels of a shard's regions, at every level.
///
/// ```text
/// tier 0   blocks of 8^3 finest voxels      levels 0, 1, 2
/// tier 1   blocks of 8^3 level-3 voxels     levels 3, 4, 5    a voxel here = a block of tier 0
/// tier 2   ...                              levels 6, 7, 8
/// ```
///
/// So a coarse voxel is there exactly as long as it has a child, and nothing counts children. Every level has a
/// counting Bloom filter of its own.
#[derive(Debug, Clone)]
pub(super) struct Shard {
    tiers: Vec<BlockTable>,
    filters: Vec<CountingBloomFilter>,
}

/// Larger tables and filters made aside, for what a change is about to add.
#[derive(Debug)]
pub(super) struct Growth {
    tiers: Vec<Option<BlockTable>>,
    filters: Vec<Option<CountingBloomFilter>>,
}

/// Keys that a filter has room for at first.
const FILTER_CAPACITY_MIN: usize = 64;

impl Shard {
    pub(super) fn new(settings: &MapSettings) -> Self {
        let filter = CountingBloomFilter::with_capacity(FILTER_CAPACITY_MIN, settings.filter);
        let tiers = tier_of(settings.levels - 1).0 + 1;
        Self {
            tiers: vec![BlockTable::with_capacity(0); tiers],
            filters: vec![filter; settings.levels as usize],
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.tiers[0].is_empty()
    }

    pub(super) fn level(&self, level: u32) -> OccupiedVoxelList<'_> {
        OccupiedVoxelList::new(level, &self.tiers[tier_of(level).0], &self.filters[level as usize])
    }

    /// Bytes of memory of the exact sets.
    pub(super) fn set_bytes(&self) -> usize {
        self.tiers.iter().map(BlockTable::bytes).sum()
    }

    /// The blocks of finest voxels.
    pub(super) fn blocks(&self) -> impl Iterator<Item = (VoxelKey, BlockMask)> + '_ {
        self.tiers[0].iter()
    }

    /// Adds voxels at every level; the number of finest voxels that were absent.
    pub(super) fn insert(&mut self, blocks: &Blocks) -> usize {
        let before = self.filters[0].len();
        let mut created = self.insert_tier(0, blocks);
        for tier in 1..self.tiers.len() {
            let blocks: VoxelSet = created.into_iter().collect();
            created = self.insert_tier(tier, blocks.blocks());
        }
        self.filters[0].len() - before
    }

    /// Adds voxels to one tier; the blocks that were absent.
    fn insert_tier(&mut self, tier: usize, blocks: &Blocks) -> Vec<VoxelKey> {
        let mut created = Vec::new();
        let filters = filters_of(&mut self.filters, tier);
        for &(block, ref mask) in blocks {
            let entry = self.tiers[tier].entry(block);
            let before = *entry;
            *entry = before.union(mask);
            if before.is_empty() {
                created.push(block);
            }
            for_each_gained(block, &before, entry, filters.len(), |up, key| filters[up].insert(key));
        }
        created
    }

    /// Takes out voxels at every level; the number of finest voxels that were present.
    pub(super) fn remove(&mut self, blocks: &Blocks) -> usize {
        let before = self.filters[0].len();
        let mut emptied = self.remove_tier(0, blocks);
        for tier in 1..self.tiers.len() {
            let blocks: VoxelSet = emptied.into_iter().collect();
            emptied = self.remove_tier(tier, blocks.blocks());
        }
        before - self.filters[0].len()
    }

    /// Takes voxels out of one tier; the blocks that lost their last one. The set says which voxels are there
    /// before the filter is told to forget them (paper II-A).
    fn remove_tier(&mut self, tier: usize, blocks: &Blocks) -> Vec<VoxelKey> {
        let mut emptied = Vec::new();
        let filters = filters_of(&mut self.filters, tier);
        for &(block, ref mask) in blocks {
            let before = self.tiers[tier].get(block);
            let after = before.difference(mask);
            if after == before {
                continue;
            }
            self.tiers[tier].set(block, after);
            if after.is_empty() {
                emptied.push(block);
            }
            for_each_gained(block, &after, &before, filters.len(), |up, key| filters[up].remove(key));
        }
        emptied
    }

    /// The finest voxels below `blocks` of `tier`, of those that are there.
    pub(super) fn descendants(&self, tier: usize, blocks: &Blocks) -> VoxelSet {
        let present =
            |&(block, mask): &(VoxelKey, BlockMask)| (block, self.tiers[tier].get(block).intersection(&mask));
        let mut found: VoxelSet = blocks.iter().map(present).collect();
        for below in (0..tier).rev() {
            found = found.iter().map(|voxel| (voxel, self.tiers[below].get(voxel))).collect();
        }
        found
    }

    /// Makes larger tables and filters for what adding `blocks` would not leave room for. Reads only: the
    /// caller swaps them in with [`Shard::adopt`] under the write lock, so that no reader waits for a rebuild.
    pub(super) fn growth_for(&self, blocks: &Blocks) -> Growth {
        let mut growth = Growth { tiers: Vec::new(), filters: Vec::new() };
        let mut parents: VoxelSet;
        let mut blocks = blocks;
        for (tier, table) in self.tiers.iter().enumerate() {
            let mut created = Vec::new();
            let mut gained = [0; BLOCK_LEVELS as usize];
            for &(block, ref mask) in blocks {
                let before = table.get(block);
                if before.is_empty() {
                    created.push(block);
                }
                let after = before.union(mask);
                for (up, gained) in gained.iter_mut().enumerate() {
                    *gained += after.count(up as u32) - before.count(up as u32);
                }
            }
            let need = table.len() + created.len();
            growth.tiers.push((need > table.capacity()).then(|| table.resized(need)));
            for (up, gained) in gained.into_iter().enumerate() {
                let level = tier * BLOCK_LEVELS as usize + up;
                if level < self.filters.len() {
                    growth.filters.push(self.larger_filter(level, gained));
                }
            }
            parents = created.into_iter().collect();
            blocks = parents.blocks();
        }
        growth
    }

    /// A filter of `level` with room for `gained` more keys, where the present one has not: the same keys in
    /// at least a quarter more space, which also forgets saturated counters.
    fn larger_filter(&self, level: usize, gained: usize) -> Option<CountingBloomFilter> {
        let filter = &self.filters[level];
        let need = filter.len() + gained;
        (need > filter.capacity()).then(|| {
            let capacity = need.max(filter.capacity() * 5 / 4);
            let mut larger = CountingBloomFilter::with_capacity(capacity, filter.settings());
            self.level(level as u32).iter().for_each(|voxel| larger.insert(voxel.to_bits()));
            larger
        })
    }

    /// Swaps in what [`Shard::growth_for`] made.
    pub(super) fn adopt(&mut self, growth: Growth) {
        replace_some(&mut self.tiers, growth.tiers);
        replace_some(&mut self.filters, growth.filters);
    }

    /// Gives back the memory of a shard that lost its last voxel, and its saturated counters with it.
    pub(super) fn reset_if_empty(&mut self, settings: &MapSettings) {
        if self.is_empty() {
            *self = Self::new(settings);
        }
    }
}

/// The filters of the levels that `tier` serves.
fn filters_of(filters: &mut [CountingBloomFilter], tier: usize) -> &mut [CountingBloomFilter] {
    let first = tier * BLOCK_LEVELS as usize;
    let end = filters.len().min(first + BLOCK_LEVELS as usize);
    &mut filters[first..end]
}

/// Calls `f(levels up, key)` for each voxel that `after` has and `before` has not, at the first `levels` levels
/// of the block.
fn for_each_gained(
    block: VoxelKey,
    before: &BlockMask,
    after: &BlockMask,
    levels: usize,
    mut f: impl FnMut(usize, u64),
) {
    for up in 0..levels {
        for cell in before.gained(after, up as u32) {
            f(up, cell.voxel(block).ancestor(up as u32).to_bits());
        }
    }
}

fn replace_some<T>(old: &mut [T], new: Vec<Option<T>>) {
    for (old, new) in old.iter_mut().zip(new) {
        if let Some(new) = new {
            *old = new;
        }
    }
}
