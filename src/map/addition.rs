//! What adding voxels to a shard comes to.

use super::lookup::ahead::fetch;
use super::room::Room;
use super::shard::{Block, Shard, levels_of};
use crate::bloom::{CountingBloomFilter, Probe};
use crate::voxel::{BlockMask, BlockTable, VoxelKey, VoxelSet};

/// What is to be done to a shard to add voxels at every level, found out while readers go on: under the write
/// lock nothing is searched for, and nothing is rebuilt. It holds for the shard as it was planned for.
#[derive(Debug)]
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
    Gains(Vec<u64>),
    Grown(CountingBloomFilter),
}

/// Blocks, or keys, whose cache misses are under way at once.
const AT_ONCE: usize = 32;

impl Addition {
    /// Finds out what adding `blocks` of finest voxels to `shard` comes to.
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
        let (mut gains, mut created) = (Vec::new(), Vec::new());
        let mut keys = vec![Vec::new(); levels.len()];
        find_each(table, blocks, |&(block, voxels), slot, before| {
            let after = before.union(&voxels);
            if after == before {
                return;
            }
            if slot.is_none() {
                created.push(block);
            }
            gains.push(Gain { block, slot, voxels });
            for (up, keys) in (0..).zip(&mut keys) {
                let gained = after.firsts(up).difference(&before.firsts(up));
                gained.for_each_key(block, up, |key| keys.push(key));
            }
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
                OfTier::Gains(gains) => gains.iter().for_each(|gain| gain.add_to(table)),
                OfTier::Grown(larger) => *table = larger,
            }
        }
        for (filter, addition) in shard.filters.iter_mut().zip(self.levels) {
            match addition {
                OfLevel::Gains(keys) => insert_all(filter, &keys),
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
    fn plan(shard: &Shard, level: usize, mut keys: Vec<u64>) -> Self {
        let filter = &shard.filters[level];
        let need = filter.len() + keys.len();
        if need <= filter.capacity() {
            return Self::Gains(keys);
        }
        let capacity = Room::of(shard.number, level).for_items(need);
        let mut larger = CountingBloomFilter::with_capacity(capacity, filter.settings());
        keys.reserve_exact(filter.len());
        shard.level(level as u32).for_each_key(|key| keys.push(key));
        insert_all(&mut larger, &keys);
        Self::Grown(larger)
    }
}

/// Calls `f(block, slot, voxels there)` for each block, with the cache misses of many under way at once.
fn find_each(table: &BlockTable, blocks: &[&Block], mut f: impl FnMut(&Block, Option<usize>, BlockMask)) {
    for blocks in blocks.chunks(AT_ONCE) {
        blocks.iter().for_each(|block| fetch(table.home(block.0)));
        let mut found = [(None, BlockMask::EMPTY); AT_ONCE];
        for (found, block) in found.iter_mut().zip(blocks) {
            let slot = table.find(block.0);
            *found = (slot, slot.map_or(BlockMask::EMPTY, |slot| *table.at(slot)));
        }
        blocks.iter().zip(found).for_each(|(block, (slot, voxels))| f(block, slot, voxels));
    }
}

/// Adds absent keys to a filter, with the cache misses of many under way at once.
fn insert_all(filter: &mut CountingBloomFilter, keys: &[u64]) {
    for keys in keys.chunks(AT_ONCE) {
        let mut probes = [Probe::default(); AT_ONCE];
        for (probe, &key) in probes.iter_mut().zip(keys) {
            *probe = filter.probe(key);
            let (word, counters) = filter.touched_at(*probe);
            fetch(word);
            fetch(counters);
        }
        probes[..keys.len()].iter().for_each(|&probe| filter.insert_at(probe));
    }
}
