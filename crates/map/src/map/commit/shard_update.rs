//! What a change of a shard comes to: voxels that go, and voxels that come.

use super::block_change::{BlockChange, block_changes};
use super::bulk::find_each;
use super::level_moves::LevelMoves;
use super::level_update::LevelUpdate;
use crate::map::change::{KeysOfLevel, LevelSet, TouchedBlocks};
use crate::map::content_hash::ContentHash;
use crate::map::moments::MomentsLost;
use crate::map::settings::MapSettings;
use crate::map::shards::{Shard, levels_of};
use crate::util::StopSignal;
use crate::voxel::{BLOCKS_PER_STOP_CHECK, BlockMask, ClusterUpdate, VoxelKey, VoxelSet};

/// What is to be done to a shard so that voxels go and come at every level, found out and built while readers go on.
/// Under the write lock pointers are exchanged, and filters' bits cleared and set; nothing is counted, and nothing is
/// rebuilt. It holds for the shard as it was planned for.
#[derive(Debug)]
#[must_use = "what is planned is counted already"]
pub(super) struct ShardUpdate {
    /// The finest voxels that go, and those that come.
    pub(super) removed: Moved,
    pub(super) added: Moved,
    /// What becomes of the moments of voxels that lose descendants, before points are added to any; nothing where none
    /// are wanted.
    pub(super) moments: MomentsLost,
    /// The keys that go and come of the levels that somebody watches.
    pub(super) noted: Vec<KeysOfLevel>,
    /// The blocks that change, where a follower wants to know them.
    pub(super) touched: TouchedBlocks,
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

/// What is to be found out of a change, besides what becomes of the voxels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    /// The levels whose keys that go and come are noted.
    pub(super) levels: LevelSet,
    /// What becomes of the moments.
    pub(super) moments: bool,
    /// The blocks that change, where somebody follows them.
    pub(super) blocks: bool,
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

impl ShardUpdate {
    /// Finds out what `changes` of blocks of finest voxels come to in `shard`, and counts them: voxels to remove that
    /// are not there are passed over, and so the set says which keys the filters are told to forget (paper II-A). Once
    /// stopped, what comes of it is not to be applied, and the shard of no use.
    pub(super) fn plan(
        shard: &Shard,
        changes: &[BlockChange<'_>],
        wanted: Wanted,
        stop: StopSignal<'_>,
    ) -> Self {
        if let Some(removed) = removes_everything(shard, changes) {
            let (moments, outcome) = (MomentsLost::Everything, Outcome::Nothing);
            let noted = wanted.levels.iter().map(|level| all_keys(shard, level)).collect();
            let touched = TouchedBlocks::everything();
            return Self { removed, added: Moved::default(), moments, noted, touched, outcome };
        }
        let (mut tiers, mut levels) = (Vec::new(), Vec::new());
        let mut finest = Tier::of(shard, 0, changes, wanted, stop);
        let moments = std::mem::take(&mut finest.moments);
        let (lost, gained) = finest.levels[0].keys();
        let (removed, added) = (Moved::of_keys(lost), Moved::of_keys(gained));
        let mut noted = finest.keys_of(wanted.levels);
        let mut touched = TouchedBlocks::default();
        touched.tiers.push(std::mem::take(&mut finest.touched));
        let (mut emptied, mut created) = finest.plan(&mut tiers, &mut levels, stop);
        for tier in 1..shard.tiers.len() {
            let (removed, added) = (VoxelSet::from_iter(emptied), VoxelSet::from_iter(created));
            let changes: Vec<_> = block_changes(&removed, &added).collect();
            let mut tier = Tier::of(shard, tier, &changes, wanted, stop);
            touched.tiers.push(std::mem::take(&mut tier.touched));
            noted.extend(tier.keys_of(wanted.levels));
            (emptied, created) = tier.plan(&mut tiers, &mut levels, stop);
        }
        Self { removed, added, moments, noted, touched, outcome: Outcome::Voxels { tiers, levels } }
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
        for (level, update) in shard.levels.iter_mut().zip(levels) {
            update.apply(level);
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

/// All keys of a level, of which none is left.
fn all_keys(shard: &Shard, level: u32) -> KeysOfLevel {
    let mut lost = Vec::new();
    shard.level(level).for_some_keys(|keys| lost.extend_from_slice(keys));
    KeysOfLevel { level, lost, gained: Vec::new() }
}

/// The part of an update in one tier of blocks.
struct Tier<'a> {
    shard: &'a Shard,
    tier: usize,
    /// Moments are wanted of what its blocks lose.
    keeps_moments: bool,
    /// The blocks that change, as they are afterwards.
    blocks: Vec<(VoxelKey, BlockMask)>,
    /// The same blocks with the voxels that change, where somebody follows them.
    touched: Vec<(VoxelKey, BlockMask)>,
    followed: bool,
    /// The blocks that lose their last voxel, and those that get their first.
    emptied: Vec<VoxelKey>,
    created: Vec<VoxelKey>,
    /// What goes and comes, level by level.
    levels: Vec<LevelMoves>,
    moments: MomentsLost,
}

impl<'a> Tier<'a> {
    fn of(
        shard: &'a Shard,
        tier: usize,
        changes: &[BlockChange<'_>],
        wanted: Wanted,
        stop: StopSignal<'_>,
    ) -> Self {
        // Filters need the keys, and so does the hash of the finest voxels.
        let keeps_keys = |level: usize| {
            level == 0 || shard.levels[level].filter.is_some() || wanted.levels.contains(level as u32)
        };
        let levels = levels_of(tier, shard.levels.len());
        let mut of = Self {
            shard,
            tier,
            keeps_moments: wanted.moments && tier == 0,
            blocks: Vec::with_capacity(changes.len()),
            touched: Vec::new(),
            followed: wanted.blocks,
            emptied: Vec::new(),
            created: Vec::new(),
            levels: levels.map(|level| LevelMoves::none(level, keeps_keys(level))).collect(),
            moments: MomentsLost::default(),
        };
        for changes in stop.pieces(changes, BLOCKS_PER_STOP_CHECK) {
            find_each(&shard.tiers[tier], changes, |change, before| of.block(change, before));
        }
        of
    }

    /// What becomes of a block.
    fn block(&mut self, change: &BlockChange<'_>, before: &BlockMask) {
        let &BlockChange { block, removed, added } = change;
        let (loses, gains) = (!before.intersection(removed).is_empty(), !added.difference(before).is_empty());
        if !loses && !gains {
            return;
        }
        let stays = before.difference(removed);
        let after = stays.union(added);
        if loses && self.keeps_moments {
            self.moments.extend(stays.rebuilt_moments(before, block));
        }
        if before.is_empty() {
            self.created.push(block);
        } else if after.is_empty() {
            self.emptied.push(block);
        }
        self.blocks.push((block, after));
        if self.followed {
            self.touched.push((block, before.symmetric_difference(&after)));
        }
        self.levels.iter_mut().for_each(|level| level.note(block, before, &after, loses));
    }

    /// The keys that go and come, of those of its levels that are noted.
    fn keys_of(&self, noted: LevelSet) -> Vec<KeysOfLevel> {
        let levels = self.levels.iter().filter(|level| noted.contains(level.level() as u32));
        levels.map(LevelMoves::to_keys_of_level).collect()
    }

    /// Plans for the tier; the blocks that lose their last voxel, and those that get their first.
    fn plan(
        self,
        tiers: &mut Vec<ClusterUpdate>,
        levels: &mut Vec<LevelUpdate>,
        stop: StopSignal<'_>,
    ) -> (Vec<VoxelKey>, Vec<VoxelKey>) {
        let Self { shard, tier, blocks, emptied, created, levels: moves, .. } = self;
        tiers.push(ClusterUpdate::plan(&shard.tiers[tier], &blocks, stop));
        drop(blocks);
        levels.extend(moves.into_iter().map(|moves| LevelUpdate::plan(shard, moves, stop)));
        (emptied, created)
    }
}
