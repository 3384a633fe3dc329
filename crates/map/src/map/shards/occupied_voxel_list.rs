//! One level of a map: the paper's occupied voxel list (OVL) with its filter (II).

use rand::seq::IndexedRandom;
use rand::{Rng, RngExt};

use super::shard_level::ShardLevel;
use crate::bloom::CountingBloomFilter;
use crate::voxel::{BLOCK_LEVELS, BlockMask, ClusterTable, VoxelKey};

/// The occupied voxels of one level, of one shard: an exact set and, in maps that have filters, the counting Bloom
/// filter in front of it, which always hold the same keys.
///
/// The exact set is a table of 8^3 blocks that serves three levels at once, so this is a view: which table, and
/// how many levels up in its blocks.
#[derive(Debug, Clone, Copy)]
pub struct OccupiedVoxelList<'a> {
    level: u32,
    blocks: &'a ClusterTable,
    of_level: &'a ShardLevel,
}

/// The table that serves `level`, and how many levels up in its blocks: (tier, levels up).
pub(in crate::map) fn tier_of(level: u32) -> (usize, u32) {
    ((level / BLOCK_LEVELS) as usize, level % BLOCK_LEVELS)
}

impl<'a> OccupiedVoxelList<'a> {
    pub(super) fn new(level: u32, blocks: &'a ClusterTable, of_level: &'a ShardLevel) -> Self {
        Self { level, blocks, of_level }
    }

    /// The list's level, 0 the finest.
    pub fn level(&self) -> u32 {
        self.level
    }

    /// How many levels the list's voxels lie above the cells of its blocks: 0, 1 or 2.
    pub(crate) fn levels_up(&self) -> u32 {
        tier_of(self.level).1
    }

    /// True when `voxel` of this level is occupied: the filter, then the set for what it lets through.
    pub fn contains(&self, voxel: VoxelKey) -> bool {
        self.filter().is_none_or(|filter| filter.contains(voxel.to_bits())) && self.set_contains(voxel)
    }

    /// False only when `voxel` of this level is certainly not occupied: the filter alone, or the set where there is
    /// none.
    pub fn may_contain(&self, voxel: VoxelKey) -> bool {
        match self.filter() {
            Some(filter) => filter.contains(voxel.to_bits()),
            None => self.set_contains(voxel),
        }
    }

    fn set_contains(&self, voxel: VoxelKey) -> bool {
        self.blocks.contains(voxel.index(), tier_of(self.level).1)
    }

    /// Number of occupied voxels.
    pub fn len(&self) -> usize {
        self.of_level.voxels
    }

    /// True without an occupied voxel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The occupied voxels, in no order.
    pub fn iter(&self) -> impl Iterator<Item = VoxelKey> + use<'a> {
        let up = tier_of(self.level).1;
        let voxels = move |(block, mask): (VoxelKey, &BlockMask)| {
            mask.cells(up).map(move |cell| cell.voxel(block).ancestor(up))
        };
        self.blocks.iter().flat_map(voxels)
    }

    /// Calls `f` with the keys of all occupied voxels, in no order: some at a time, so that they are still near.
    pub(in crate::map) fn for_some_keys(&self, mut f: impl FnMut(&[u64])) {
        const SOME: usize = 256;
        let (up, mut keys) = (tier_of(self.level).1, Vec::with_capacity(2 * SOME));
        self.blocks.iter().for_each(|(block, mask)| {
            BlockMask::EMPTY.keys_gained(mask, block, up, &mut keys);
            if keys.len() >= SOME {
                f(&keys);
                keys.clear();
            }
        });
        f(&keys);
    }

    /// About `wish` occupied voxels, spread over the blocks: some of every n-th block, from a random start.
    pub fn sample(&self, wish: usize, random: &mut impl Rng) -> Vec<VoxelKey> {
        let up = tier_of(self.level).1;
        let blocks = self.blocks.len().max(1);
        let stride = (blocks / wish.max(1)).max(1);
        let of_each = wish.div_ceil(blocks);
        let start = random.random_range(0..stride);
        let mut sample = Vec::with_capacity(wish + of_each);
        for (block, mask) in self.blocks.iter().skip(start).step_by(stride) {
            let cells: Vec<_> = mask.cells(up).collect();
            let chosen = cells.sample(random, of_each);
            sample.extend(chosen.map(|cell| cell.voxel(block).ancestor(up)));
        }
        sample
    }

    /// The filter; none in a map without filters.
    pub fn filter(&self) -> Option<&'a CountingBloomFilter> {
        self.of_level.filter.as_ref()
    }

    /// The exact set, shared with up to two other levels.
    pub fn blocks(&self) -> &'a ClusterTable {
        self.blocks
    }
}
