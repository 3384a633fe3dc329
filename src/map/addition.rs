//! What adding voxels to a shard comes to.

use super::bulk::{change_each, count_each, find_each, show_each};
use super::room::Room;
use super::shard::{Block, Shard, levels_of};
use crate::bloom::{CountingBloomFilter, Probe};
use crate::voxel::{BlockMask, BlockTable, VoxelKey, VoxelSet};

/// What is to be done to a shard to add voxels at every level, found out while readers go on: under the write
/// lock nothing is searched for, nothing is counted, and nothing is rebuilt. It holds for the shard as it was planned
/// for.
#[derive(Debug)]
#[must_use = "what is planned is counted already"]
pub(super) struct Addition {
    tiers: Vec<OfTier>,
    levels: Vec<OfLevel>,
}

/// What becomes of a tier's table.
#[derive(Debug)]
enum OfTier {
    /// It has room.
    Gains(Vec<Gain>),
    /// It gives way to a larger one, which has the new voxels already.
    Grown(BlockTable),
}

/// A block that gains voxels.
#[derive(Debug)]
struct Gain {
    block: VoxelKey,
    /// Where it is; none where it is absent.
    slot: Option<usize>,
    voxels: BlockMask,
}

/// What becomes of a level's filter: as of a tier's table.
#[derive(Debug)]
enum OfLevel {
    Gains(Vec<Probe>),
    Grown(CountingBloomFilter),
}

impl Addition {
    /// Finds out what adding `blocks` of finest voxels to `shard` comes to, and counts them.
    pub(super) fn plan(shard: &Shard, blocks: &[&Block]) -> Self {
        let mut plan = Self { tiers: Vec::new(), levels: Vec::new() };
        let mut created = plan.tier(shard, 0, blocks);
        for tier in 1..shard.tiers.len() {
            let blocks: VoxelSet = created.into_iter().collect();
            created = plan.tier(shard, tier, &blocks.blocks().iter().collect::<Vec<_>>());
        }
        plan
    }

    /// Plans for one tier; the blocks that are absent so far.
    fn tier(&mut self, shard: &Shard, tier: usize, blocks: &[&Block]) -> Vec<VoxelKey> {
        let table = &shard.tiers[tier];
        let levels = levels_of(tier, shard.filters.len());
        let (mut gains, mut created) = (Vec::with_capacity(blocks.len()), Vec::new());
        let mut keys = vec![Vec::new(); levels.len()];
        find_each(table, blocks, |&(block, ref voxels), slot, before| {
            if voxels.difference(before).is_empty() {
                return;
            }
            if slot.is_none() {
                created.push(block);
            }
            gains.push(Gain { block, slot, voxels: *voxels });
            (0..).zip(&mut keys).for_each(|(up, keys)| before.keys_gained(voxels, block, up, keys));
        });
        self.tiers.push(OfTier::plan(shard, tier, gains, created.len()));
        self.levels.extend(levels.zip(keys).map(|(level, keys)| OfLevel::plan(shard, level, keys)));
        created
    }

    /// Does it; the number of finest voxels that were absent.
    pub(super) fn apply(self, shard: &mut Shard) -> usize {
        let before = shard.filters[0].len();
        for (table, addition) in shard.tiers.iter_mut().zip(self.tiers) {
            match addition {
                OfTier::Gains(gains) => {
                    change_each(table, &gains, |gain| gain.slot, |table, gain| gain.add_to(table))
                }
                OfTier::Grown(larger) => *table = larger,
            }
        }
        for (filter, addition) in shard.filters.iter_mut().zip(self.levels) {
            match addition {
                OfLevel::Gains(probes) => show_each(filter, &probes, CountingBloomFilter::set_bits),
                OfLevel::Grown(larger) => *filter = larger,
            }
        }
        shard.filters[0].len() - before
    }
}

impl Gain {
    fn add_to(&self, table: &mut BlockTable) {
        let mask = match self.slot {
            Some(slot) => table.at_mut(slot),
            None => table.entry(self.block),
        };
        *mask = mask.union(&self.voxels);
    }
}

impl OfTier {
    fn plan(shard: &Shard, tier: usize, mut gains: Vec<Gain>, created: usize) -> Self {
        let table = &shard.tiers[tier];
        let need = table.len() + created;
        if need <= table.capacity() {
            return Self::Gains(gains);
        }
        let mut larger = table.with_room_for(Room::of(shard.number, tier).for_items(need));
        for gain in &mut gains {
            // Elsewhere, in the larger one.
            gain.slot = None;
            gain.add_to(&mut larger);
        }
        Self::Grown(larger)
    }
}

impl OfLevel {
    /// A larger filter also forgets saturated counters.
    fn plan(shard: &Shard, level: usize, keys: Vec<u64>) -> Self {
        let filter = &shard.filters[level];
        let need = filter.len() + keys.len();
        if need <= filter.capacity() {
            return Self::Gains(count_each(filter, &keys, CountingBloomFilter::count_in));
        }
        let capacity = Room::of(shard.number, level).for_items(need);
        let mut larger = CountingBloomFilter::with_capacity(capacity, filter.settings());
        larger.insert_each(&keys);
        shard.level(level as u32).for_some_keys(|keys| larger.insert_each(keys));
        Self::Grown(larger)
    }
}
