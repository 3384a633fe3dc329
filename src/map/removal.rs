//! What taking voxels out of a shard comes to.

use super::bulk::{count_each, find_each, write_plane_bits};
use super::shard::{Block, Shard, levels_of};
use super::{ContentHash, MapSettings, moments::MomentsLost};
use crate::bloom::{CountingBloomFilter, Probe};
use crate::util::StopSignal;
use crate::voxel::{BLOCKS_PER_LOOK, ClusterUpdate, VoxelKey, VoxelSet};

/// What is to be done to a shard to take voxels out at every level, found out while readers go on. Under the write lock
/// pointers are exchanged, and at most [`CLEARED_IN_PLACE`] bits a level cleared, however much goes. It holds for the
/// shard as it was planned for.
#[derive(Debug)]
#[must_use = "what is planned is counted already"]
pub(super) struct Removal {
    /// Finest voxels that go.
    voxels: usize,
    /// Hash of the finest voxels that go.
    hash: ContentHash,
    /// Finest voxels that stay.
    left: Left,
    /// What becomes of the moments of voxels that lose descendants.
    moments: MomentsLost,
}

/// What a shard is left with.
#[derive(Debug)]
enum Left {
    /// No voxel.
    Nothing,
    /// Some, or all.
    Voxels { tiers: Vec<ClusterUpdate>, levels: Vec<OfLevel> },
}

/// What becomes of the bit plane of a level's filter.
#[derive(Debug)]
enum OfLevel {
    /// The filter loses these bits.
    Loses(Vec<Probe>),
    /// The filter's plane gives way to one without the bits of so many keys.
    Plane { plane: Vec<u64>, keys_lost: usize },
}

/// Keys a level whose bits are cleared in place, while readers wait. Beyond that a copy of the plane is cleared
/// beforehand, which takes longer in all and keeps nobody waiting.
const CLEARED_IN_PLACE: usize = 2048;

impl Removal {
    /// Finds out what taking `blocks` of finest voxels out of `shard` comes to, and counts them out: those that are
    /// not there are passed over, and so the set says which ones the filter is told to forget (paper II-A). Once stopped,
    /// what comes of it is not to be applied, and the shard of no use.
    pub(super) fn plan(shard: &Shard, blocks: &[&Block], stop: StopSignal<'_>) -> Self {
        let voxels = voxels_there(shard, blocks);
        if voxels > 0 && voxels == shard.level(0).len() {
            let mut hash = ContentHash::default();
            shard.level(0).for_some_keys(|keys| hash = hash.with(ContentHash::of_keys(keys)));
            return Self { voxels, hash, left: Left::Nothing, moments: MomentsLost::Everything };
        }
        let (mut tiers, mut levels, mut moments) = (Vec::new(), Vec::new(), MomentsLost::default());
        let finest = Tier::of(shard, 0, blocks, &mut moments, stop);
        let hash = ContentHash::of_keys(&finest.keys[0]);
        let mut emptied = finest.plan(&mut tiers, &mut levels, stop);
        for tier in 1..shard.tiers.len() {
            let blocks: VoxelSet = emptied.into_iter().collect();
            let blocks: Vec<_> = blocks.blocks().iter().collect();
            emptied = Tier::of(shard, tier, &blocks, &mut moments, stop).plan(&mut tiers, &mut levels, stop);
        }
        Self { voxels, hash, left: Left::Voxels { tiers, levels }, moments }
    }

    /// Number of finest voxels that go.
    pub(super) fn voxels(&self) -> usize {
        self.voxels
    }

    /// Hash of the finest voxels that go.
    pub(super) fn hash(&self) -> ContentHash {
        self.hash
    }

    /// What becomes of the moments of voxels that lose descendants.
    pub(super) fn moments(&self) -> &MomentsLost {
        &self.moments
    }

    /// Does it, but for the moments. What the shard held and holds no more is for the caller to drop, once nobody
    /// waits.
    pub(super) fn apply(self, shard: &mut Shard, settings: &MapSettings) -> Option<Shard> {
        let Left::Voxels { tiers, levels } = self.left else {
            let empty = Shard::new(shard.number, settings);
            return Some(std::mem::replace(shard, empty));
        };
        for (table, renewal) in shard.tiers.iter_mut().zip(tiers) {
            renewal.apply(table);
        }
        for (filter, level) in shard.filters.iter_mut().zip(levels) {
            match level {
                OfLevel::Loses(cleared) => {
                    write_plane_bits(filter, &cleared, CountingBloomFilter::clear_bits)
                }
                OfLevel::Plane { plane, keys_lost } => filter.set_plane(plane, keys_lost),
            }
        }
        None
    }
}

/// How many of the voxels of `blocks` are in the shard.
fn voxels_there(shard: &Shard, blocks: &[&Block]) -> usize {
    let mut voxels = 0;
    find_each(&shard.tiers[0], blocks, |(_, mask), there| voxels += there.intersection(mask).count(0));
    voxels
}

/// The part of a removal in one tier of blocks.
struct Tier<'a> {
    shard: &'a Shard,
    tier: usize,
    /// The blocks that lose a voxel, as they are afterwards.
    losses: Vec<Block>,
    /// The voxels that lose their last descendant.
    emptied: Vec<VoxelKey>,
    /// What goes, level by level.
    keys: Vec<Vec<u64>>,
}

impl<'a> Tier<'a> {
    fn of(
        shard: &'a Shard,
        tier: usize,
        blocks: &[&Block],
        moments: &mut MomentsLost,
        stop: StopSignal<'_>,
    ) -> Self {
        let levels = levels_of(tier, shard.filters.len()).len();
        let (mut losses, mut emptied, mut keys) = (Vec::new(), Vec::new(), vec![Vec::new(); levels]);
        for blocks in stop.pieces(blocks, BLOCKS_PER_LOOK) {
            find_each(&shard.tiers[tier], blocks, |&(block, ref voxels), before| {
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
                    moments.extend(left.rebuilt_moments(before, block));
                }
            });
        }
        Self { shard, tier, losses, emptied, keys }
    }

    /// Plans for the tier; the blocks that lose their last voxel.
    fn plan(
        self,
        tiers: &mut Vec<ClusterUpdate>,
        levels: &mut Vec<OfLevel>,
        stop: StopSignal<'_>,
    ) -> Vec<VoxelKey> {
        let Self { shard, tier, losses, emptied, keys } = self;
        tiers.push(ClusterUpdate::plan(&shard.tiers[tier], &losses, stop));
        drop(losses);
        let of_level = |(level, keys): (usize, Vec<u64>)| OfLevel::plan(&shard.filters[level], keys, stop);
        levels.extend(levels_of(tier, shard.filters.len()).zip(keys).map(of_level));
        emptied
    }
}

impl OfLevel {
    fn plan(filter: &CountingBloomFilter, keys: Vec<u64>, stop: StopSignal<'_>) -> Self {
        if keys.len() <= CLEARED_IN_PLACE {
            return Self::Loses(count_each(filter, &keys, CountingBloomFilter::count_out));
        }
        let mut plane = filter.plane().to_vec();
        for keys in stop.pieces(&keys, CLEARED_IN_PLACE) {
            for cleared in count_each(filter, keys, CountingBloomFilter::count_out) {
                plane[cleared.word] &= !cleared.mask;
            }
        }
        Self::Plane { plane, keys_lost: keys.len() }
    }
}
