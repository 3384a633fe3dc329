//! All levels of one part of space.

use std::ops::Range;

use super::occupied_voxel_list::{OccupiedVoxelList, tier_of};
use super::shard_level::ShardLevel;
use crate::map::settings::MapSettings;
use crate::voxel::{BLOCK_LEVELS, BlockMask, ClusterTable, VoxelKey, VoxelSet};

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
/// counting Bloom filter of its own, in maps that have filters.
#[derive(Debug)]
pub(in crate::map) struct Shard {
    /// Which of the map's shards it is.
    pub(in crate::map) number: usize,
    pub(in crate::map) tiers: Vec<ClusterTable>,
    pub(in crate::map) levels: Vec<ShardLevel>,
}

impl Shard {
    pub(in crate::map) fn new(number: usize, settings: &MapSettings) -> Self {
        let tiers = tier_of(settings.levels - 1).0 + 1;
        Self {
            number,
            tiers: std::iter::repeat_with(ClusterTable::default).take(tiers).collect(),
            levels: (0..settings.levels).map(|_| ShardLevel::empty(settings)).collect(),
        }
    }

    pub(in crate::map) fn is_empty(&self) -> bool {
        self.tiers[0].is_empty()
    }

    pub(in crate::map) fn level(&self, level: u32) -> OccupiedVoxelList<'_> {
        OccupiedVoxelList::new(level, &self.tiers[tier_of(level).0], &self.levels[level as usize])
    }

    /// Bytes of memory of the exact sets.
    pub(in crate::map) fn set_bytes(&self) -> usize {
        self.tiers.iter().map(ClusterTable::bytes).sum()
    }

    /// The blocks of finest voxels.
    pub(in crate::map) fn blocks(&self) -> impl Iterator<Item = (VoxelKey, BlockMask)> + '_ {
        self.tiers[0].iter().map(|(block, mask)| (block, *mask))
    }

    /// The finest voxels below `blocks` of `tier`, of those that are there.
    pub(in crate::map) fn descendants(&self, tier: usize, blocks: &[Block]) -> VoxelSet {
        let present =
            |&(block, mask): &(VoxelKey, BlockMask)| (block, self.tiers[tier].get(block).intersection(&mask));
        let mut found: VoxelSet = blocks.iter().map(present).collect();
        for below in (0..tier).rev() {
            found = found.iter().map(|voxel| (voxel, *self.tiers[below].get(voxel))).collect();
        }
        found
    }
}

/// The levels that `tier` serves, of a map that has `levels` of them.
pub(in crate::map) fn levels_of(tier: usize, levels: usize) -> Range<usize> {
    let first = tier * BLOCK_LEVELS as usize;
    first..levels.min(first + BLOCK_LEVELS as usize)
}
