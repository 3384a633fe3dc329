//! What adding voxels to a shard comes to.

use super::ContentHash;
use super::bulk::{count_each, find_each, write_plane_bits};
use super::capacity_schedule::CapacitySchedule;
use super::shard::{Block, Shard, levels_of};
use crate::bloom::{CountingBloomFilter, Probe};
use crate::util::StopSignal;
use crate::voxel::{BLOCKS_PER_LOOK, ClusterUpdate, VoxelKey, VoxelSet};

/// Keys that a filter is built of between two looks at the stop signal: some milliseconds.
const KEYS_PER_LOOK: usize = 64 << 10;

/// What is to be done to a shard to add voxels at every level, found out and built while readers go on: under the write
/// lock clusters and filters are exchanged, and bits set; nothing is counted, and nothing is rebuilt. It holds for the
/// shard as it was planned for.
#[derive(Debug)]
#[must_use = "what is planned is counted already"]
pub(super) struct Addition {
    tiers: Vec<ClusterUpdate>,
    levels: Vec<OfLevel>,
    /// Hash of the finest voxels that were absent.
    hash: ContentHash,
}

/// What becomes of a level's filter.
#[derive(Debug)]
enum OfLevel {
    /// The filter has capacity for the new keys: their probes.
    Gains(Vec<Probe>),
    /// The filter gives way to a larger one, which has the new voxels already.
    Grown(CountingBloomFilter),
}

impl Addition {
    /// Finds out what adding `blocks` of finest voxels to `shard` comes to, and counts them. Once stopped, what comes of it
    /// is not to be applied, and the shard of no use.
    pub(super) fn plan(shard: &Shard, blocks: &[&Block], stop: StopSignal<'_>) -> Self {
        let mut plan = Self { tiers: Vec::new(), levels: Vec::new(), hash: ContentHash::default() };
        let mut created = plan.tier(shard, 0, blocks, stop);
        for tier in 1..shard.tiers.len() {
            let blocks: VoxelSet = created.into_iter().collect();
            created = plan.tier(shard, tier, &blocks.blocks().iter().collect::<Vec<_>>(), stop);
        }
        plan
    }

    /// Plans for one tier; the blocks that are absent so far.
    fn tier(&mut self, shard: &Shard, tier: usize, blocks: &[&Block], stop: StopSignal<'_>) -> Vec<VoxelKey> {
        let table = &shard.tiers[tier];
        let levels = levels_of(tier, shard.filters.len());
        let (mut gains, mut created) = (Vec::with_capacity(blocks.len()), Vec::new());
        let mut keys = vec![Vec::new(); levels.len()];
        for blocks in stop.pieces(blocks, BLOCKS_PER_LOOK) {
            find_each(table, blocks, |&(block, ref voxels), before| {
                if voxels.difference(before).is_empty() {
                    return;
                }
                if before.is_empty() {
                    created.push(block);
                }
                gains.push((block, before.union(voxels)));
                (0..).zip(&mut keys).for_each(|(up, keys)| before.keys_gained(voxels, block, up, keys));
            });
        }
        if tier == 0 {
            self.hash = ContentHash::of_keys(&keys[0]);
        }
        self.tiers.push(ClusterUpdate::plan(table, &gains, stop));
        self.levels.extend(levels.zip(keys).map(|(level, keys)| OfLevel::plan(shard, level, keys, stop)));
        created
    }

    /// Hash of the finest voxels that were absent.
    pub(super) fn hash(&self) -> ContentHash {
        self.hash
    }

    /// Does it; the number of finest voxels that were absent.
    pub(super) fn apply(self, shard: &mut Shard) -> usize {
        let before = shard.filters[0].len();
        for (table, renewal) in shard.tiers.iter_mut().zip(self.tiers) {
            renewal.apply(table);
        }
        for (filter, addition) in shard.filters.iter_mut().zip(self.levels) {
            match addition {
                OfLevel::Gains(probes) => write_plane_bits(filter, &probes, CountingBloomFilter::set_bits),
                OfLevel::Grown(larger) => *filter = larger,
            }
        }
        shard.filters[0].len() - before
    }
}

impl OfLevel {
    /// A larger filter also forgets saturated counters.
    fn plan(shard: &Shard, level: usize, keys: Vec<u64>, stop: StopSignal<'_>) -> Self {
        let filter = &shard.filters[level];
        let need = filter.len() + keys.len();
        if need <= filter.capacity() {
            return Self::Gains(count_each(filter, &keys, CountingBloomFilter::count_in));
        }
        let capacity = CapacitySchedule::of(shard.number, level).for_items(need);
        let mut larger = CountingBloomFilter::with_capacity(capacity, filter.settings());
        stop.pieces(&keys, KEYS_PER_LOOK).for_each(|keys| larger.insert_each(keys));
        shard.level(level as u32).for_some_keys(|keys| larger.insert_each(keys));
        Self::Grown(larger)
    }
}
