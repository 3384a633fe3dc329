//! The moments of a map's points: what alignments refine poses on.

use hashbrown::HashMap;

use super::shards::{SHARDS, Sharding};
use crate::sync::{Rank, RwLock, RwLockReadGuard, RwLockWriteGuard};
use crate::util::StopSignal;
use crate::voxel::{MOMENT_LEVEL, MomentSet, Moments, VoxelKey};

/// Voxels whose moments are copied or added between two looks at the stop signal: a millisecond or so.
const VOXELS_PER_STOP_CHECK: usize = 16 << 10;

/// The moments of the points in each voxel of [`MOMENT_LEVEL`], in shards like the voxels themselves.
///
/// They have locks of their own, since look-ups, which are many, never ask for them, and a table that grows here may
/// take a while. Where both kinds of locks are taken, these are taken first.
#[derive(Debug)]
pub(super) struct ShardedMoments {
    sharding: Sharding,
    shards: [RwLock<MomentShard>; SHARDS],
}

/// The moments of one shard.
#[derive(Debug, Default)]
pub(super) struct MomentShard(HashMap<VoxelKey, Moments>);

/// Read locks on all moments of a map: while it lives, they do not change.
#[derive(Debug)]
pub struct MomentsView<'a> {
    sharding: Sharding,
    shards: [RwLockReadGuard<'a, MomentShard>; SHARDS],
}

/// Keeps refinements waiting until a change is published.
pub(super) type MomentLocks<'a> = Vec<RwLockWriteGuard<'a, MomentShard>>;

/// Moments of voxels of one shard.
pub(super) type MomentsOfShard = Vec<(VoxelKey, Moments)>;

/// What becomes of the moments of one shard's voxels that lose descendants.
#[derive(Debug)]
pub(super) enum MomentsLost {
    /// All moments go.
    Everything,
    /// Some go, others are rebuilt from the voxels that stay.
    Some { gone: Vec<VoxelKey>, rebuilt: MomentsOfShard },
}

impl MomentsLost {
    /// True where no moments change.
    fn is_empty(&self) -> bool {
        matches!(self, Self::Some { gone, rebuilt } if gone.is_empty() && rebuilt.is_empty())
    }
}

impl Default for MomentsLost {
    fn default() -> Self {
        Self::Some { gone: Vec::new(), rebuilt: Vec::new() }
    }
}

impl Extend<(VoxelKey, Moments)> for MomentsLost {
    /// Adds voxels with what their moments become; none of no points are kept.
    fn extend<I: IntoIterator<Item = (VoxelKey, Moments)>>(&mut self, changed: I) {
        if let Self::Some { gone, rebuilt } = self {
            for (voxel, moments) in changed {
                match moments.is_empty() {
                    true => gone.push(voxel),
                    false => rebuilt.push((voxel, moments)),
                }
            }
        }
    }
}

impl ShardedMoments {
    pub(super) fn new(sharding: Sharding) -> Self {
        let shard = |i| RwLock::new(Rank::Moments(i as u8), MomentShard::default());
        Self { sharding, shards: std::array::from_fn(shard) }
    }

    /// Locks them for reading, in ascending order.
    pub(super) fn view(&self) -> MomentsView<'_> {
        let shards = std::array::from_fn(|i| self.shards[i].read());
        MomentsView { sharding: self.sharding, shards }
    }

    /// Changes shards, in ascending order: what voxels `lost` is taken out, moments are `added`, and last those that
    /// are `known` take the place of what is there. Shards without any of this are passed over; some of it is done once
    /// stopped.
    pub(super) fn change<'l>(
        &self,
        lost: impl IntoIterator<Item = (usize, &'l MomentsLost)>,
        added: &[MomentsOfShard; SHARDS],
        known: &[MomentsOfShard; SHARDS],
        stop: StopSignal<'_>,
    ) -> MomentLocks<'_> {
        let mut losses = [const { None }; SHARDS];
        lost.into_iter().filter(|(_, lost)| !lost.is_empty()).for_each(|(i, lost)| losses[i] = Some(lost));
        let changes = |&i: &usize| losses[i].is_some() || !added[i].is_empty() || !known[i].is_empty();
        let changed = |i: usize| {
            let mut shard = self.shards[i].write();
            losses[i].into_iter().for_each(|lost| shard.lose(lost));
            shard.add(&added[i], stop);
            shard.set(&known[i]);
            shard.reset_if_empty();
            shard
        };
        (0..SHARDS).filter(changes).map(changed).collect()
    }

    /// The moments of `set`, shard by shard.
    pub(super) fn group(&self, set: &MomentSet) -> [MomentsOfShard; SHARDS] {
        let mut by_shard: [MomentsOfShard; SHARDS] = Default::default();
        for &(voxel, moments) in set.as_slice() {
            by_shard[self.sharding.shard_of(voxel.index(), MOMENT_LEVEL)].push((voxel, moments));
        }
        by_shard
    }
}

impl MomentShard {
    /// Adds the moments of points whose voxels are, or are about to be, occupied; some of them once stopped.
    fn add(&mut self, moments: &[(VoxelKey, Moments)], stop: StopSignal<'_>) {
        for &(voxel, added) in stop.pieces(moments, VOXELS_PER_STOP_CHECK).flatten() {
            *self.0.entry(voxel).or_default() += added;
        }
    }

    /// Takes out what voxels that lose descendants lose.
    fn lose(&mut self, lost: &MomentsLost) {
        match lost {
            MomentsLost::Everything => *self = Self::default(),
            MomentsLost::Some { gone, rebuilt } => {
                for voxel in gone {
                    self.0.remove(voxel);
                }
                self.set(rebuilt);
            }
        }
    }

    /// Puts moments in the place of those that are there; none of no points are kept.
    fn set(&mut self, moments: &[(VoxelKey, Moments)]) {
        for &(voxel, moments) in moments {
            match moments.is_empty() {
                true => drop(self.0.remove(&voxel)),
                false => drop(self.0.insert(voxel, moments)),
            }
        }
    }

    /// Gives back the memory of a shard that lost its last moments.
    fn reset_if_empty(&mut self) {
        if self.0.is_empty() {
            *self = Self::default();
        }
    }
}

impl MomentsView<'_> {
    /// The moments of the points in a voxel of [`MOMENT_LEVEL`].
    pub fn of(&self, voxel: VoxelKey) -> Option<&Moments> {
        self.shards[self.sharding.shard_of(voxel.index(), MOMENT_LEVEL)].0.get(&voxel)
    }

    /// All moments.
    pub fn to_set(&self) -> MomentSet {
        self.to_set_until(StopSignal::NEVER)
    }

    /// All moments; once stopped, some of them.
    pub(super) fn to_set_until(&self, stop: StopSignal<'_>) -> MomentSet {
        let mut all = Vec::with_capacity(self.shards.iter().map(|shard| shard.0.len()).sum());
        let entries = stop.paced(self.shards.iter().flat_map(|shard| &shard.0), VOXELS_PER_STOP_CHECK);
        all.extend(entries.map(|(&voxel, &moments)| (voxel, moments)));
        MomentSet::of_voxels_until(all, stop)
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        self.shards.iter().map(|shard| shard.0.allocation_size()).sum()
    }
}
