//! What a change of a shard comes to: voxels that go, and voxels that come.

use super::bulk::find_each;
use super::level_update::LevelUpdate;
use super::moments::MomentsLost;
use super::shard::{Shard, levels_of};
use super::{ContentHash, MapSettings};
use crate::util::StopSignal;
use crate::voxel::{BLOCKS_PER_LOOK, BlockMask, ClusterUpdate, VoxelKey, VoxelSet};

/// What a change does to a block: voxels go first, where they are there, and then voxels come.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockChange<'a> {
    pub(super) block: VoxelKey,
    pub(super) removed: &'a BlockMask,
    pub(super) added: &'a BlockMask,
}

/// What is to be done to a shard so that voxels go and come at every level, found out and built while readers go on. Under
/// the write lock pointers are exchanged, and filters' bits cleared and set; nothing is counted, and nothing is rebuilt. It
/// holds for the shard as it was planned for.
#[derive(Debug)]
#[must_use = "what is planned is counted already"]
pub(super) struct ShardUpdate {
    /// The finest voxels that go, and those that come.
    pub(super) removed: Moved,
    pub(super) added: Moved,
    /// What becomes of the moments of voxels that lose descendants, before points are added to any.
    pub(super) moments: MomentsLost,
    outcome: Outcome,
}

/// Finest voxels that go, or come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Moved {
    pub(super) voxels: usize,
    pub(super) hash: ContentHash,
}

/// What a shard is left with.
#[derive(Debug)]
enum Outcome {
    /// No voxel.
    Nothing,
    /// Some, or all.
    Voxels { tiers: Vec<ClusterUpdate>, levels: Vec<LevelUpdate> },
}

impl Moved {
    /// The finest voxels with these keys.
    fn of_keys(keys: &[u64]) -> Self {
        Self { voxels: keys.len(), hash: ContentHash::of_keys(keys) }
    }

    /// These voxels and others.
    pub(super) fn and(self, other: Self) -> Self {
        Self { voxels: self.voxels + other.voxels, hash: self.hash.with(other.hash) }
    }
}

/// The changes, in ascending order of their blocks, by which the voxels of `removed` go and those of `added` come.
pub(super) fn block_changes<'a>(
    removed: &'a VoxelSet,
    added: &'a VoxelSet,
) -> impl Iterator<Item = BlockChange<'a>> {
    let (mut removed, mut added) = (removed.blocks().iter().peekable(), added.blocks().iter().peekable());
    std::iter::from_fn(move || {
        let next = match (removed.peek(), added.peek()) {
            (Some((one, _)), Some((other, _))) => *one.min(other),
            (Some((block, _)), None) | (None, Some((block, _))) => *block,
            (None, None) => return None,
        };
        let removed =
            removed.next_if(|(block, _)| *block == next).map_or(&BlockMask::EMPTY, |(_, mask)| mask);
        let added = added.next_if(|(block, _)| *block == next).map_or(&BlockMask::EMPTY, |(_, mask)| mask);
        Some(BlockChange { block: next, removed, added })
    })
}

impl ShardUpdate {
    /// Finds out what `changes` of blocks of finest voxels come to in `shard`, and counts them: voxels to remove that are not
    /// there are passed over, and so the set says which keys the filters are told to forget (paper II-A). Once stopped, what
    /// comes of it is not to be applied, and the shard of no use.
    pub(super) fn plan(shard: &Shard, changes: &[BlockChange<'_>], stop: StopSignal<'_>) -> Self {
        if let Some(removed) = removes_everything(shard, changes) {
            let (moments, outcome) = (MomentsLost::Everything, Outcome::Nothing);
            return Self { removed, added: Moved::default(), moments, outcome };
        }
        let (mut tiers, mut levels, mut moments) = (Vec::new(), Vec::new(), MomentsLost::default());
        let finest = Tier::of(shard, 0, changes, &mut moments, stop);
        let (removed, added) = (Moved::of_keys(&finest.lost[0]), Moved::of_keys(&finest.gained[0]));
        let (mut emptied, mut created) = finest.plan(&mut tiers, &mut levels, stop);
        for tier in 1..shard.tiers.len() {
            let (removed, added) = (VoxelSet::from_iter(emptied), VoxelSet::from_iter(created));
            let changes: Vec<_> = block_changes(&removed, &added).collect();
            let tier = Tier::of(shard, tier, &changes, &mut moments, stop);
            (emptied, created) = tier.plan(&mut tiers, &mut levels, stop);
        }
        Self { removed, added, moments, outcome: Outcome::Voxels { tiers, levels } }
    }

    /// Does it, but for the moments. What the shard held and holds no more is for the caller to drop, once nobody
    /// waits.
    pub(super) fn apply(self, shard: &mut Shard, settings: &MapSettings) -> Option<Shard> {
        let Outcome::Voxels { tiers, levels } = self.outcome else {
            let empty = Shard::new(shard.number, settings);
            return Some(std::mem::replace(shard, empty));
        };
        for (table, update) in shard.tiers.iter_mut().zip(tiers) {
            update.apply(table);
        }
        for (filter, update) in shard.filters.iter_mut().zip(levels) {
            update.apply(filter);
        }
        None
    }
}

/// The finest voxels of the shard, where there are some and all of them go.
fn removes_everything(shard: &Shard, changes: &[BlockChange<'_>]) -> Option<Moved> {
    let voxels = shard.level(0).len();
    let removes_only = |change: &BlockChange<'_>| change.added.is_empty();
    // A block that stays tells it at once, of what only adds, and of most of what removes.
    if voxels == 0 || changes.len() < shard.tiers[0].len() || !changes.iter().all(removes_only) {
        return None;
    }
    let mut removed = 0;
    find_each(&shard.tiers[0], changes, |change, there| {
        removed += there.intersection(change.removed).count(0)
    });
    let mut hash = ContentHash::default();
    (removed == voxels).then(|| {
        shard.level(0).for_some_keys(|keys| hash = hash.with(ContentHash::of_keys(keys)));
        Moved { voxels, hash }
    })
}

/// The part of an update in one tier of blocks.
struct Tier<'a> {
    shard: &'a Shard,
    tier: usize,
    /// The blocks that change, as they are afterwards.
    blocks: Vec<(VoxelKey, BlockMask)>,
    /// The blocks that lose their last voxel, and those that get their first.
    emptied: Vec<VoxelKey>,
    created: Vec<VoxelKey>,
    /// The keys that go and come, level by level.
    lost: Vec<Vec<u64>>,
    gained: Vec<Vec<u64>>,
}

impl<'a> Tier<'a> {
    fn of(
        shard: &'a Shard,
        tier: usize,
        changes: &[BlockChange<'_>],
        moments: &mut MomentsLost,
        stop: StopSignal<'_>,
    ) -> Self {
        let levels = levels_of(tier, shard.filters.len()).len();
        let keys = || vec![Vec::new(); levels];
        let blocks = Vec::with_capacity(changes.len());
        let (emptied, created, lost, gained) = (Vec::new(), Vec::new(), keys(), keys());
        let mut of = Self { shard, tier, blocks, emptied, created, lost, gained };
        for changes in stop.pieces(changes, BLOCKS_PER_LOOK) {
            find_each(&shard.tiers[tier], changes, |change, before| of.block(change, before, moments));
        }
        of
    }

    /// What becomes of a block.
    fn block(&mut self, change: &BlockChange<'_>, before: &BlockMask, moments: &mut MomentsLost) {
        let &BlockChange { block, removed, added } = change;
        let (loses, gains) = (!before.intersection(removed).is_empty(), !added.difference(before).is_empty());
        if !loses && !gains {
            return;
        }
        let stays = before.difference(removed);
        let after = stays.union(added);
        if loses && self.tier == 0 {
            moments.extend(stays.rebuilt_moments(before, block));
        }
        if before.is_empty() {
            self.created.push(block);
        } else if after.is_empty() {
            self.emptied.push(block);
        }
        self.blocks.push((block, after));
        (0..).zip(&mut self.gained).for_each(|(up, keys)| before.keys_gained(&after, block, up, keys));
        if loses {
            // What is gone is what would be gained if all came back.
            (0..).zip(&mut self.lost).for_each(|(up, keys)| after.keys_gained(before, block, up, keys));
        }
    }

    /// Plans for the tier; the blocks that lose their last voxel, and those that get their first.
    fn plan(
        self,
        tiers: &mut Vec<ClusterUpdate>,
        levels: &mut Vec<LevelUpdate>,
        stop: StopSignal<'_>,
    ) -> (Vec<VoxelKey>, Vec<VoxelKey>) {
        let Self { shard, tier, blocks, emptied, created, lost, gained } = self;
        tiers.push(ClusterUpdate::plan(&shard.tiers[tier], &blocks, stop));
        drop(blocks);
        let keys = lost.into_iter().zip(gained);
        let of_level = |(level, (lost, gained))| LevelUpdate::plan(shard, level, lost, gained, stop);
        levels.extend(levels_of(tier, shard.filters.len()).zip(keys).map(of_level));
        (emptied, created)
    }
}
