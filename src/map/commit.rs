//! How a map is changed: one change at a time, in the order of revisions.
//!
//! A change is planned first, which takes long and holds up nobody, since a plan only reads and no one else changes
//! the map meanwhile. Then it waits until nobody reads for long ([`MultiResolutionMap::long_read`]), and last it takes
//! the write locks of what it touches, for which it waits behind short readers only. Short readers therefore never
//! queue behind a change that itself waits for a long one.

use super::addition::Addition;
use super::moments::{MomentLocks, MomentsOfShard};
use super::removal::Removal;
use super::shard::{Block, Shard};
use super::sharding::SHARDS;
use super::{
    Change, CompletedRequest, ContentHash, ContentVersion, MappedScan, MultiResolutionMap, Request,
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
    /// Finest voxels added or removed.
    pub voxels: usize,
}

impl Committed {
    /// The revision after the change, with its hash.
    pub fn version(&self) -> ContentVersion {
        ContentVersion { revision: self.revision, hash: self.hash }
    }

    /// No change of a map at `version`.
    pub fn none(version: ContentVersion) -> Self {
        Self::at(version, 0)
    }

    /// A change at `version` of `voxels` finest voxels.
    fn at(ContentVersion { revision, hash }: ContentVersion, voxels: usize) -> Self {
        Self { revision, hash, voxels }
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
            Change::Deletion(deletion) => self.delete(&deletion.voxels, deletion.request.as_ref(), stop),
            Change::Undo(undo) => self.undo(undo, stop),
        }
    }

    /// Adds a scan's voxels at every level and its pose to the trajectory; always makes a revision.
    pub fn insert_scan(self, scan: ScanRecord) -> Committed {
        self.apply(&Change::Insertion(scan))
    }

    fn insert(self, scan: &ScanRecord, stop: StopSignal<'_>) -> Option<Committed> {
        let planned = self.plan_addition(&scan.voxels, &scan.moments, stop);
        if stop.is_stopped() {
            return None;
        }
        let version = self.next(|hash| hash.with(hash_added_by(&planned.0)));
        let (_locks, voxels) = self.add_to_shards(planned, stop);
        if stop.is_stopped() {
            return None;
        }
        let mut trajectory = self.map.trajectory.write();
        let committed = Committed::at(version, voxels);
        trajectory.push(MappedScan { revision: committed.revision, new_voxels: voxels, ..scan.pose.clone() });
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
        let planned = self.plan_addition(voxels, moments, stop);
        if stop.is_stopped() {
            return None;
        }
        let hash = hash_added_by(&planned.0);
        self.add_to_shards(planned, stop);
        (!stop.is_stopped()).then_some(hash)
    }

    /// Takes finest voxels out, and every coarser one that loses its last child. Voxels that are not there are
    /// passed over; removing none makes no revision.
    pub fn remove(self, voxels: &VoxelSet) -> Committed {
        let unchanged = self.unchanged();
        self.delete(voxels, None, StopSignal::NEVER).unwrap_or(unchanged)
    }

    fn delete(self, voxels: &VoxelSet, request: Option<&Request>, stop: StopSignal<'_>) -> Option<Committed> {
        let by_shard = self.group(voxels);
        let planned = self.plan(touched(&by_shard), |i, shard| Removal::plan(shard, &by_shard[i], stop));
        if stop.is_stopped() {
            return None;
        }
        let removed = removed_by(&planned);
        if removed == 0 {
            return Some(self.unchanged());
        }
        let committed = Committed::at(self.next(|hash| hash.without(hash_removed_by(&planned))), removed);
        let _locks = self.take_out(planned, &Default::default());
        self.remember(request, committed, 0);
        Some(self.publish(committed))
    }

    /// Takes scans out of the trajectory, and the voxels that they alone held; always makes a revision.
    fn undo(self, undo: &UndoRecord, stop: StopSignal<'_>) -> Option<Committed> {
        let by_shard = self.group(&undo.voxels);
        // All of them, so that nobody who has a view of the whole map sees the trajectory change.
        let planned = self.plan(0..SHARDS, |i, shard| Removal::plan(shard, &by_shard[i], stop));
        if stop.is_stopped() {
            return None;
        }
        let removed = removed_by(&planned);
        let committed = Committed::at(self.next(|hash| hash.without(hash_removed_by(&planned))), removed);
        let _locks = self.take_out(planned, &self.map.moments.group(&undo.moments));
        let mut trajectory = self.map.trajectory.write();
        trajectory.withdraw(&undo.scans, committed.revision);
        self.remember(undo.request.as_ref(), committed, undo.scans.len());
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

    fn remember(
        &self,
        request: Option<&Request>,
        Committed { revision, voxels, .. }: Committed,
        scans: usize,
    ) {
        if let Some(Request { id, digest, caller }) = request.cloned() {
            self.map.requests.write().push(CompletedRequest { id, digest, caller, revision, voxels, scans });
        }
    }

    /// Makes the change visible: readers that get a lock from now on report this revision.
    fn publish(&self, committed: Committed) -> Committed {
        self.map.published.publish(committed.version());
        committed
    }

    /// The next version of the map, whose hash becomes what `change` says.
    fn next(&self, change: impl FnOnce(ContentHash) -> ContentHash) -> ContentVersion {
        let ContentVersion { revision, hash } = self.map.content_version();
        ContentVersion { revision: revision + 1, hash: change(hash) }
    }

    /// The map as it is.
    fn unchanged(&self) -> Committed {
        Committed::none(self.map.content_version())
    }

    /// The blocks of `voxels`, shard by shard. A block lies in one region, and so in one shard.
    fn group<'v>(&self, voxels: &'v VoxelSet) -> [Vec<&'v Block>; SHARDS] {
        let mut by_shard: [Vec<_>; SHARDS] = Default::default();
        for block in voxels.blocks() {
            let finest = block.0.index().map(|i| i << BLOCK_LEVELS);
            by_shard[self.map.sharding.shard_of(finest, 0)].push(block);
        }
        by_shard
    }

    /// Finds out what adding voxels and the moments of points in them comes to.
    fn plan_addition(&self, voxels: &VoxelSet, moments: &MomentSet, stop: StopSignal<'_>) -> PlannedAddition {
        let (by_shard, moments) = (self.group(voxels), self.map.moments.group(moments));
        let planned = self.plan(touched(&by_shard), |i, shard| Addition::plan(shard, &by_shard[i], stop));
        (planned, moments)
    }

    /// Adds what is planned, or some of it once stopped; the number of voxels that were absent.
    fn add_to_shards(&self, (planned, moments): PlannedAddition, stop: StopSignal<'_>) -> (Locks<'a>, usize) {
        let no_long_read = self.map.long_reads.write();
        let added_moments = moments.iter().enumerate().filter(|(_, moments)| !moments.is_empty());
        let moments = self.map.moments.change(added_moments, |shard, moments| shard.add(moments, stop));
        let mut added = 0;
        let shards = self.carry_out(planned, |shard, addition| added += addition.apply(shard));
        (
            Locks { _shards: shards, _moments: moments, _no_long_read: no_long_read, _emptied: Vec::new() },
            added,
        )
    }

    /// Takes voxels out. Their moments are rebuilt from what remains, or become `moments` where those are known.
    fn take_out(&self, planned: Plans<Removal>, moments: &[MomentsOfShard; SHARDS]) -> Locks<'a> {
        let no_long_read = self.map.long_reads.write();
        let changed = planned.iter().map(|(i, removal)| (*i, (removal.moments(), &moments[*i])));
        let moments = self.map.moments.change(changed, |shard, (lost, known)| {
            shard.lose(lost);
            shard.set(known);
            shard.reset_if_empty();
        });
        let mut emptied = Vec::new();
        let shards = self.carry_out(planned, |shard, removal| {
            emptied.extend(removal.apply(shard, &self.map.settings));
        });
        Locks { _shards: shards, _moments: moments, _no_long_read: no_long_read, _emptied: emptied }
    }

    /// Finds out what a change of some shards comes to, and builds what it needs, while readers go on.
    fn plan<P>(
        &self,
        shards: impl IntoIterator<Item = usize>,
        mut plan: impl FnMut(usize, &Shard) -> P,
    ) -> Plans<P> {
        shards.into_iter().map(|i| (i, plan(i, &self.map.shards[i].read()))).collect()
    }

    /// Does what is planned under the write locks, which are taken in ascending order.
    fn carry_out<P>(
        &self,
        planned: Plans<P>,
        mut apply: impl FnMut(&mut Shard, P),
    ) -> Vec<RwLockWriteGuard<'a, Shard>> {
        let lock = |(i, plan): (usize, P)| {
            let mut shard = self.map.shards[i].write();
            apply(&mut shard, plan);
            shard
        };
        planned.into_iter().map(lock).collect()
    }
}

/// Parts of a change, each with the number of its shard, ascending. A shard is as it was planned for until the change
/// is carried out, since the turn to change the map is held meanwhile.
type Plans<P> = Vec<(usize, P)>;

/// An addition shard by shard, and the moments that it adds.
type PlannedAddition = (Plans<Addition>, [MomentsOfShard; SHARDS]);

/// Keeps readers of what changed waiting until the change is published.
struct Locks<'a> {
    _shards: Vec<RwLockWriteGuard<'a, Shard>>,
    _moments: MomentLocks<'a>,
    _no_long_read: RwLockWriteGuard<'a, ()>,
    /// What was in shards that lost everything: to give back its memory takes a while, so it comes last.
    _emptied: Vec<Shard>,
}

/// The shards that have a part of a change, ascending.
fn touched(by_shard: &[Vec<&Block>; SHARDS]) -> impl Iterator<Item = usize> {
    (0..SHARDS).filter(|&i| !by_shard[i].is_empty())
}

/// Hash of the finest voxels that are added.
fn hash_added_by(planned: &Plans<Addition>) -> ContentHash {
    planned.iter().fold(ContentHash::default(), |hash, (_, addition)| hash.with(addition.hash()))
}

/// Hash of the finest voxels that go.
fn hash_removed_by(planned: &Plans<Removal>) -> ContentHash {
    planned.iter().fold(ContentHash::default(), |hash, (_, removal)| hash.with(removal.hash()))
}

fn removed_by(planned: &Plans<Removal>) -> usize {
    planned.iter().map(|(_, removal)| removal.voxels()).sum()
}
