//! All levels of one part of space.

use std::ops::Range;

use hashbrown::HashMap;

use super::MapSettings;
use super::occupied_voxel_list::{OccupiedVoxelList, tier_of};
use super::room::Room;
use crate::bloom::CountingBloomFilter;
use crate::voxel::{BLOCK_LEVELS, BlockMask, BlockTable, Moments, VoxelKey, VoxelSet};

/// A block of a tier and its voxels.
pub(super) type Block = (VoxelKey, BlockMask);

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
    /// Which of the map's shards it is.
    pub(super) number: usize,
    pub(super) tiers: Vec<BlockTable>,
    pub(super) filters: Vec<CountingBloomFilter>,
    /// Of the points in each voxel of [`MOMENT_LEVEL`](crate::voxel::MOMENT_LEVEL).
    moments: HashMap<VoxelKey, Moments>,
}

impl Shard {
    pub(super) fn new(number: usize, settings: &MapSettings) -> Self {
        let filter =
            |level| CountingBloomFilter::with_capacity(Room::of(number, level).for_items(1), settings.filter);
        let tiers = tier_of(settings.levels - 1).0 + 1;
        Self {
            number,
            tiers: vec![BlockTable::with_capacity(0); tiers],
            filters: (0..settings.levels as usize).map(filter).collect(),
            moments: HashMap::new(),
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

    /// Bytes of memory of the moments.
    pub(super) fn moment_bytes(&self) -> usize {
        self.moments.allocation_size()
    }

    /// The moments of the points in a voxel of [`MOMENT_LEVEL`](crate::voxel::MOMENT_LEVEL).
    pub(super) fn moments_of(&self, voxel: VoxelKey) -> Option<&Moments> {
        self.moments.get(&voxel)
    }

    /// All moments, in no order.
    pub(super) fn moments(&self) -> impl Iterator<Item = (VoxelKey, Moments)> + '_ {
        self.moments.iter().map(|(&voxel, &moments)| (voxel, moments))
    }

    /// Adds the moments of points whose voxels are, or are about to be, occupied.
    pub(super) fn add_moments(&mut self, moments: &[(VoxelKey, Moments)]) {
        for &(voxel, added) in moments {
            *self.moments.entry(voxel).or_default() += added;
        }
    }

    /// Puts moments in the place of those that are there; none of no points are kept.
    pub(super) fn set_moments(&mut self, moments: &[(VoxelKey, Moments)]) {
        set_moments(&mut self.moments, moments.iter().copied());
    }

    /// The blocks of finest voxels.
    pub(super) fn blocks(&self) -> impl Iterator<Item = (VoxelKey, BlockMask)> + '_ {
        self.tiers[0].iter()
    }

    /// Takes out voxels at every level; the number of finest voxels that were present.
    pub(super) fn remove(&mut self, blocks: &[&Block]) -> usize {
        let before = self.filters[0].len();
        let mut emptied = self.remove_tier(0, blocks.iter().copied());
        for tier in 1..self.tiers.len() {
            let blocks: VoxelSet = emptied.into_iter().collect();
            emptied = self.remove_tier(tier, blocks.blocks());
        }
        before - self.filters[0].len()
    }

    /// Takes voxels out of one tier; the blocks that lost their last one. The set says which voxels are there
    /// before the filter is told to forget them (paper II-A).
    fn remove_tier<'a>(&mut self, tier: usize, blocks: impl IntoIterator<Item = &'a Block>) -> Vec<VoxelKey> {
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
            for (up, filter) in (0..).zip(filters.iter_mut()) {
                let gone = before.firsts(up).difference(&after.firsts(up));
                gone.for_each_key(block, up, |key| filter.remove(key));
            }
            if tier == 0 {
                set_moments(&mut self.moments, after.rebuilt_moments(&before, block));
            }
        }
        emptied
    }

    /// The finest voxels below `blocks` of `tier`, of those that are there.
    pub(super) fn descendants(&self, tier: usize, blocks: &[Block]) -> VoxelSet {
        let present =
            |&(block, mask): &(VoxelKey, BlockMask)| (block, self.tiers[tier].get(block).intersection(&mask));
        let mut found: VoxelSet = blocks.iter().map(present).collect();
        for below in (0..tier).rev() {
            found = found.iter().map(|voxel| (voxel, self.tiers[below].get(voxel))).collect();
        }
        found
    }

    /// Gives back the memory of a shard that lost its last voxel, and its saturated counters with it.
    pub(super) fn reset_if_empty(&mut self, settings: &MapSettings) {
        if self.is_empty() {
            *self = Self::new(self.number, settings);
        }
    }
}

fn set_moments(all: &mut HashMap<VoxelKey, Moments>, moments: impl IntoIterator<Item = (VoxelKey, Moments)>) {
    for (voxel, moments) in moments {
        match moments.is_empty() {
            true => drop(all.remove(&voxel)),
            false => drop(all.insert(voxel, moments)),
        }
    }
}

/// The filters of the levels that `tier` serves.
fn filters_of(filters: &mut [CountingBloomFilter], tier: usize) -> &mut [CountingBloomFilter] {
    let levels = levels_of(tier, filters.len());
    &mut filters[levels]
}

/// The levels that `tier` serves, of a map that has `levels` of them.
pub(super) fn levels_of(tier: usize, levels: usize) -> Range<usize> {
    let first = tier * BLOCK_LEVELS as usize;
    first..levels.min(first + BLOCK_LEVELS as usize)
}
