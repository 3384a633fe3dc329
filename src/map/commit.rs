//! How a map is changed: one change at a time, in the order of revisions.
//!
//! A change is planned first, which takes long and holds up nobody, since a plan only reads and no one else changes
//! the map meanwhile. Then it waits until nobody reads for long ([`MultiResolutionMap::long_read`]), and last it takes
//! the write locks of what it touches, for which it waits behind short readers only. Short readers therefore never
//! queue behind a change that itself waits for a long one.

use super::moments::{MomentLocks, MomentsOfShard};
use super::shard::Shard;
use super::sharding::SHARDS;
use super::update::{BlockChange, Moved, ShardUpdate, block_changes};
use super::{
    Change, CompletedRequest, ContentHash, ContentVersion, DeletionRecord, MappedScan, MultiResolutionMap,
    ScanRecord, TrajectorySpacing, UndoRecord,
};
use crate::sync::{MutexGuard, RwLockWriteGuard};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, MomentSet, VoxelSet};

/// The turn to change a map. Others wait for it; readers do not.
#[derive(Debug)]
pub struct Committer<'a> {
    map: &'a MultiResolutionMap,
    _turn: MutexGuard<'a, ()>,
}

/// A change that was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Committed {
    /// The revision after it.
    pub revision: u64,
    /// Hash of what the map holds after it.
    pub hash: ContentHash,
    /// Finest voxels that it added.
    pub added: usize,
    /// Finest voxels that it took out.
    pub removed: usize,
}

impl Committed {
    /// The revision after the change, with its hash.
    pub fn version(&self) -> ContentVersion {
        ContentVersion { revision: self.revision, hash: self.hash }
    }

    /// No change of a map at `version`.
    pub fn none(ContentVersion { revision, hash }: ContentVersion) -> Self {
        Self { revision, hash, added: 0, removed: 0 }
    }
}

impl<'a> Committer<'a> {
    pub(super) fn begin(map: &'a MultiResolutionMap) -> Self {
        Self { map, _turn: map.commit_queue.lock() }
    }

    /// The map, which nobody else changes meanwhile.
    pub fn map(&self) -> &'a MultiResolutionMap {
        self.map
    }

    /// Makes `change`, for the first time or again.
    pub fn apply(self, change: &Change) -> Committed {
        let unchanged = self.unchanged();
        // It is always made: nobody stops it.
        self.apply_until(change, StopSignal::NEVER).unwrap_or(unchanged)
    }

    /// [`Committer::apply`] under a stop signal; none once stopped, and the map is of no use then.
    pub fn apply_until(self, change: &Change, stop: StopSignal<'_>) -> Option<Committed> {
        match change {
            Change::Insertion(scan) => self.insert(scan, stop),
            Change::Deletion(deletion) => self.delete(deletion, stop),
            Change::Undo(undo) => self.undo(undo, stop),
        }
    }

    /// Adds a scan's voxels at every level and its pose to the trajectory; always makes a revision.
    pub fn insert_scan(self, scan: ScanRecord) -> Committed {
        self.apply(&Change::Insertion(scan))
    }

    /// Takes finest voxels out, and every coarser one that loses its last child. Voxels that are not there are
    /// passed over; removing none makes no revision.
    pub fn remove(self, voxels: &VoxelSet) -> Committed {
        self.apply(&Change::Deletion(DeletionRecord { voxels: voxels.clone(), request: None }))
    }

    fn insert(self, scan: &ScanRecord, stop: StopSignal<'_>) -> Option<Committed> {
        let update = self.plan(&scan.carved, &scan.voxels, stop)?;
        let committed = self.next(&update);
        let _locks =
            self.carry_out(update, &self.map.moments.group(&scan.moments), &Default::default(), stop)?;
        let mut trajectory = self.map.trajectory.write();
        let pose =
            MappedScan { revision: committed.revision, new_voxels: committed.added, ..scan.pose.clone() };
        trajectory.push(pose);
        Some(self.publish(committed))
    }

    /// Adds finest voxels and moments, with neither pose nor revision: what [`MultiResolutionMap::restore`] begins
    /// with. The hash of the voxels; none once stopped: the map is of no use then.
    pub(super) fn add(
        self,
        voxels: &VoxelSet,
        moments: &MomentSet,
        stop: StopSignal<'_>,
    ) -> Option<ContentHash> {
        let update = self.plan(&VoxelSet::default(), voxels, stop)?;
        let hash = update.added.hash;
        self.carry_out(update, &self.map.moments.group(moments), &Default::default(), stop)?;
        Some(hash)
    }

    fn delete(self, deletion: &DeletionRecord, stop: StopSignal<'_>) -> Option<Committed> {
        let update = self.plan(&deletion.voxels, &VoxelSet::default(), stop)?;
        if update.removed.voxels == 0 {
            return Some(self.unchanged());
        }
        let committed = self.next(&update);
        let _locks = self.carry_out(update, &Default::default(), &Default::default(), StopSignal::NEVER)?;
        if let Some(request) = &deletion.request {
            self.remember(CompletedRequest::of_deletion(request, &committed));
        }
        Some(self.publish(committed))
    }

    /// Takes changes back: the scans leave the trajectory, what they alone held goes, and what they or deletions took away
    /// comes back. Always makes a revision.
    fn undo(self, undo: &UndoRecord, stop: StopSignal<'_>) -> Option<Committed> {
        // All shards, so that nobody who has a view of the whole map sees the trajectory change.
        let update = self.plan_in(&undo.removed, &undo.restored, 0..SHARDS, stop)?;
        let committed = self.next(&update);
        let _locks = self.carry_out(
            update,
            &Default::default(),
            &self.map.moments.group(&undo.moments),
            StopSignal::NEVER,
        )?;
        let mut trajectory = self.map.trajectory.write();
        trajectory.withdraw(undo.changes(), committed.revision);
        if let Some(request) = &undo.request {
            self.remember(CompletedRequest::of_undo(request, undo, &committed));
        }
        Some(self.publish(committed))
    }

    /// Thins the trajectory before the revision `before`, see [`Trajectory::thin`](super::Trajectory::thin); the number
    /// of poses that went. Makes no revision. Readers go on meanwhile.
    pub fn thin(self, before: u64, spacing: &TrajectorySpacing) -> usize {
        let mut thinned = self.map.trajectory();
        let gone = thinned.thin(before, spacing);
        // What goes is dropped when nobody waits for the lock any more.
        let _thick = std::mem::replace(&mut *self.map.trajectory.write(), thinned);
        gone
    }

    fn remember(&self, request: CompletedRequest) {
        self.map.requests.write().push(request);
    }

    /// Makes the change visible: readers that get a lock from now on report this revision.
    fn publish(&self, committed: Committed) -> Committed {
        self.map.published.publish(committed.version());
        committed
    }

    /// What the change is once it is made: the next revision.
    fn next(&self, update: &MapUpdate) -> Committed {
        let ContentVersion { revision, hash } = self.map.content_version();
        let MapUpdate { added, removed, .. } = update;
        Committed {
            revision: revision + 1,
            hash: hash.with(added.hash).without(removed.hash),
            added: added.voxels,
            removed: removed.voxels,
        }
    }

    /// The map as it is.
    fn unchanged(&self) -> Committed {
        Committed::none(self.map.content_version())
    }

    /// Finds out what it comes to that voxels go and others come, and builds what it needs, while readers go on; none once
    /// stopped.
    fn plan(&self, removed: &VoxelSet, added: &VoxelSet, stop: StopSignal<'_>) -> Option<MapUpdate> {
        self.plan_in(removed, added, [], stop)
    }

    /// [`Committer::plan`], with all `shards` even where nothing changes in them.
    fn plan_in(
        &self,
        removed: &VoxelSet,
        added: &VoxelSet,
        shards: impl IntoIterator<Item = usize>,
        stop: StopSignal<'_>,
    ) -> Option<MapUpdate> {
        let by_shard = self.group(removed, added);
        let mut is_planned = by_shard.each_ref().map(|changes| !changes.is_empty());
        shards.into_iter().for_each(|i| is_planned[i] = true);
        let plan = |i: usize| (i, ShardUpdate::plan(&self.map.shards[i].read(), &by_shard[i], stop));
        let shards: Vec<_> = (0..SHARDS).filter(|&i| is_planned[i]).map(plan).collect();
        let total = |of: fn(&ShardUpdate) -> Moved| {
            shards.iter().fold(Moved::default(), |all, (_, update)| all.and(of(update)))
        };
        let (removed, added) = (total(|update| update.removed), total(|update| update.added));
        (!stop.is_stopped()).then_some(MapUpdate { removed, added, shards })
    }

    /// What becomes of the blocks, shard by shard. A block lies in one region, and so in one shard.
    fn group<'v>(&self, removed: &'v VoxelSet, added: &'v VoxelSet) -> [Vec<BlockChange<'v>>; SHARDS] {
        let mut by_shard: [Vec<_>; SHARDS] = Default::default();
        for change in block_changes(removed, added) {
            let finest = change.block.index().map(|i| i << BLOCK_LEVELS);
            by_shard[self.map.sharding.shard_of(finest, 0)].push(change);
        }
        by_shard
    }

    /// Does what is planned under the write locks, which are taken in ascending order. Moments of voxels that lose
    /// descendants are rebuilt from what remains; then those of points are `added`, and those that are `known` take the
    /// place of what is there. None once stopped.
    fn carry_out(
        &self,
        update: MapUpdate,
        added: &[MomentsOfShard; SHARDS],
        known: &[MomentsOfShard; SHARDS],
        stop: StopSignal<'_>,
    ) -> Option<Locks<'a>> {
        let no_long_read = self.map.long_reads.write();
        let lost = update.shards.iter().map(|(i, update)| (*i, &update.moments));
        let moments = self.map.moments.change(lost, added, known, stop);
        let mut emptied = Vec::new();
        let lock = |(i, update): (usize, ShardUpdate)| {
            let mut shard = self.map.shards[i].write();
            emptied.extend(update.apply(&mut shard, &self.map.settings));
            shard
        };
        let shards = update.shards.into_iter().map(lock).collect();
        let locks =
            Locks { _shards: shards, _moments: moments, _no_long_read: no_long_read, _emptied: emptied };
        (!stop.is_stopped()).then_some(locks)
    }
}

/// What is to be done to a map. A shard is as it was planned for until the change is carried out, since the turn to change
/// the map is held meanwhile.
struct MapUpdate {
    /// The finest voxels that go, and those that come.
    removed: Moved,
    added: Moved,
    /// Each with the number of its shard, ascending.
    shards: Vec<(usize, ShardUpdate)>,
}

/// Keeps readers of what changed waiting until the change is published.
struct Locks<'a> {
    _shards: Vec<RwLockWriteGuard<'a, Shard>>,
    _moments: MomentLocks<'a>,
    _no_long_read: RwLockWriteGuard<'a, ()>,
    /// What was in shards that lost everything: to give back its memory takes a while, so it comes last.
    _emptied: Vec<Shard>,
}
