//! What taking voxels out of a shard comes to.

use super::bulk::{count_each, find_each, show_each};
use super::shard::{Block, Shard, levels_of};
use crate::bloom::{CountingBloomFilter, Probe};
use crate::voxel::{Moments, Renewal, VoxelKey, VoxelSet};

/// What is to be done to a shard to take voxels out at every level, found out while readers go on. It holds for the
/// shard as it was planned for.
#[derive(Debug)]
#[must_use = "what is planned is counted already"]
pub(super) struct Removal {
    tiers: Vec<Renewal>,
    /// What each level's plane loses.
    levels: Vec<Vec<Probe>>,
    moments: Vec<(VoxelKey, Moments)>,
}

impl Removal {
    /// Finds out what taking `blocks` of finest voxels out of `shard` comes to, and counts them out: those that are
    /// not there are passed over, and so the set says which ones the filter is told to forget (paper II-A).
    pub(super) fn plan(shard: &Shard, blocks: &[&Block]) -> Self {
        let mut plan = Self { tiers: Vec::new(), levels: Vec::new(), moments: Vec::new() };
        let mut emptied = plan.tier(shard, 0, blocks);
        for tier in 1..shard.tiers.len() {
            let blocks: VoxelSet = emptied.into_iter().collect();
            emptied = plan.tier(shard, tier, &blocks.blocks().iter().collect::<Vec<_>>());
        }
        plan
    }

    /// Plans for one tier; the blocks that lose their last voxel.
    fn tier(&mut self, shard: &Shard, tier: usize, blocks: &[&Block]) -> Vec<VoxelKey> {
        let table = &shard.tiers[tier];
        let levels = levels_of(tier, shard.filters.len());
        let (mut losses, mut emptied) = (Vec::new(), Vec::new());
        let mut keys = vec![Vec::new(); levels.len()];
        find_each(table, blocks, |&(block, ref voxels), before| {
            if before.intersection(voxels).is_empty() {
                return;
            }
            let left = before.difference(voxels);
            losses.push((block, left));
            if left.is_empty() {
                emptied.push(block);
            }
            // What is gone is what would be gained if all came back.
            (0..).zip(&mut keys).for_each(|(up, keys)| left.keys_gained(before, block, up, keys));
            if tier == 0 {
                self.moments.extend(left.rebuilt_moments(before, block));
            }
        });
        self.tiers.push(Renewal::plan(table, &losses));
        let count_out = |(level, keys): (usize, Vec<u64>)| {
            count_each(&shard.filters[level], &keys, CountingBloomFilter::count_out)
        };
        self.levels.extend(levels.zip(keys).map(count_out));
        emptied
    }

    /// Number of finest voxels that go.
    pub(super) fn voxels(&self) -> usize {
        self.levels[0].len()
    }

    /// What becomes of the moments of voxels that lose descendants.
    pub(super) fn moments(&self) -> &[(VoxelKey, Moments)] {
        &self.moments
    }

    /// Does it, but for the moments.
    pub(super) fn apply(self, shard: &mut Shard) {
        for (table, renewal) in shard.tiers.iter_mut().zip(self.tiers) {
            renewal.apply(table);
        }
        for (filter, cleared) in shard.filters.iter_mut().zip(&self.levels) {
            show_each(filter, cleared, CountingBloomFilter::clear_bits);
        }
    }
}
