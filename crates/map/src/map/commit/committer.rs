//! How a map is changed: one change at a time, in the order of revisions.
//!
//! A change is planned first, which takes long and holds up nobody, since a plan only reads and no one else changes
//! the map meanwhile. Then it waits until nobody reads for long ([`MultiResolutionMap::long_read`]), and last it takes
//! the write locks of what it touches, for which it waits behind short readers only. Short readers therefore never
//! queue behind a change that itself waits for a long one.

use std::sync::Arc;

use super::block_change::{BlockChange, block_changes};
use super::shard_update::{Moved, ShardUpdate, Wanted};
use crate::map::change::{
    Change, Committed, CompletedRequest, DeletionRecord, KeepOutRecord, LevelChange, LevelSet, TouchedBlocks,
    UndoRecord,
};
use crate::map::content_hash::{ContentHash, ContentVersion};
use crate::map::moments::{MomentLocks, MomentsOfShard};
use crate::map::multi_resolution_map::MultiResolutionMap;
use crate::map::shards::{SHARDS, Shard};
use crate::map::trajectory::{MappedScan, ScanRecord, TrajectorySpacing, ViewpointRecord};
use crate::sync::{MutexGuard, RwLockWriteGuard};
use crate::util::StopSignal;
use crate::visibility::{Viewpoint, ViewpointSet};
use crate::voxel::{BLOCK_LEVELS, MomentSet, VoxelSet};

/// The turn to change a map. Others wait for it; readers do not.
#[derive(Debug)]
pub struct Committer<'a> {
    map: &'a MultiResolutionMap,
    /// The levels of which it is noted what the change does.
    noted: LevelSet,
    /// True where a follower wants to know which blocks change.
    followed: bool,
    _turn: MutexGuard<'a, ()>,
}

impl<'a> Committer<'a> {
    pub(super) fn begin(map: &'a MultiResolutionMap) -> Self {
        let turn = map.commit_queue.lock();
        Self { map, noted: LevelSet::default(), followed: map.followers.want_blocks(), _turn: turn }
    }

    /// The map, which nobody else changes meanwhile.
    pub fn map(&self) -> &'a MultiResolutionMap {
        self.map
    }

    /// Makes `change`, for the first time or again.
    pub fn apply(self, change: &Change) -> Committed {
        self.apply_noting(change, LevelSet::default()).0
    }

    /// [`Committer::apply`], with what the change does to the levels of `noted`, ascending.
    pub fn apply_noting(self, change: &Change, noted: LevelSet) -> (Committed, Vec<LevelChange>) {
        let unchanged = self.unchanged();
        // It is always made: nobody stops it.
        Self { noted, ..self }.make(change, StopSignal::NEVER).unwrap_or((unchanged, Vec::new()))
    }

    /// [`Committer::apply`] under a stop signal; none once stopped, and the map is of no use then.
    pub fn apply_until(self, change: &Change, stop: StopSignal<'_>) -> Option<Committed> {
        Some(self.make(change, stop)?.0)
    }

    fn make(self, change: &Change, stop: StopSignal<'_>) -> Option<Made> {
        match change {
            Change::Insertion(scan) => self.insert(scan, stop),
            Change::Deletion(deletion) => self.delete(deletion, stop),
            Change::Undo(undo) => self.undo(undo, stop),
            Change::KeepOut(keep_out) => Some(self.change_keep_outs(keep_out)),
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

    /// Takes finest voxels out and then adds others, as another map did; always makes a revision, with neither pose nor
    /// moments. For copies of a map.
    pub fn exchange(self, removed: &VoxelSet, added: &VoxelSet) -> Committed {
        self.exchange_seen(removed, added, ViewpointChange::default())
    }

    /// [`Committer::exchange`], where viewpoints come and go as well.
    pub fn exchange_seen(self, removed: &VoxelSet, added: &VoxelSet, seen: ViewpointChange) -> Committed {
        let unchanged = self.unchanged();
        let exchange = || {
            let mut update = self.plan(removed, added, StopSignal::NEVER)?;
            let made = self.next(&mut update);
            let _locks = self.carry_out(update, Gained::default(), StopSignal::NEVER)?;
            let mut viewpoints = self.map.viewpoints.write();
            seen.apply(&mut viewpoints, made.0.revision);
            Some(self.publish(made).0)
        };
        // It is always made: nobody stops it.
        exchange().unwrap_or(unchanged)
    }

    fn insert(self, scan: &ScanRecord, stop: StopSignal<'_>) -> Option<Made> {
        let mut update = self.plan(&scan.carved, &scan.voxels, stop)?;
        let made = self.next(&mut update);
        let committed = &made.0;
        let image = scan.viewpoint.as_ref().map(|viewpoint| viewpoint.image.clone());
        let viewpoint = image.map(|image| Arc::new(Viewpoint::new(scan.pose.map_from_sensor, image)));
        let _locks = self.carry_out(update, self.adding(&scan.moments), stop)?;
        let mut viewpoints = self.map.viewpoints.write();
        let mut trajectory = self.map.trajectory.write();
        let pose = MappedScan {
            revision: committed.revision,
            new_voxels: committed.added,
            carved_voxels: committed.removed,
            ..scan.pose.clone()
        };
        trajectory.push(pose);
        let gone = scan.viewpoint.as_ref().map(|ViewpointRecord { displaced, .. }| displaced.clone());
        let seen = ViewpointChange { left: viewpoint, gone: gone.unwrap_or_default() };
        seen.apply(&mut viewpoints, made.0.revision);
        Some(self.publish(made))
    }

    /// Adds finest voxels and moments, with neither pose nor revision: what [`MultiResolutionMap::restore`] begins
    /// with. The hash of the voxels; none once stopped: the map is of no use then. The sets go as soon as they were
    /// taken apart, so that they are not in memory beside what is made of them.
    pub(in crate::map) fn add(
        self,
        voxels: VoxelSet,
        moments: MomentSet,
        stop: StopSignal<'_>,
    ) -> Option<ContentHash> {
        let update = self.plan(&VoxelSet::default(), &voxels, stop)?;
        drop(voxels);
        let hash = update.added.hash;
        let gained = self.adding(&moments);
        drop(moments);
        self.carry_out(update, gained, stop)?;
        Some(hash)
    }

    fn delete(self, deletion: &DeletionRecord, stop: StopSignal<'_>) -> Option<Made> {
        let mut update = self.plan(&deletion.voxels, &VoxelSet::default(), stop)?;
        if update.removed.voxels == 0 {
            return Some((self.unchanged(), Vec::new()));
        }
        let made = self.next(&mut update);
        let _locks = self.carry_out(update, Gained::default(), StopSignal::NEVER)?;
        if let Some(request) = &deletion.request {
            self.remember(CompletedRequest::of_deletion(request, &made.0));
        }
        Some(self.publish(made))
    }

    /// Takes changes back: the scans leave the trajectory, what they alone held goes, and what they or deletions took
    /// away comes back. Always makes a revision.
    fn undo(self, undo: &UndoRecord, stop: StopSignal<'_>) -> Option<Made> {
        // All shards, so that no view of the whole map sees the trajectory change.
        let mut update = self.plan_in(&undo.removed, &undo.restored, 0..SHARDS, stop)?;
        let made = self.next(&mut update);
        let known = self.grouped(&undo.moments);
        let _locks = self.carry_out(update, Gained { known, ..Gained::default() }, StopSignal::NEVER)?;
        let mut viewpoints = self.map.viewpoints.write();
        ViewpointChange { left: None, gone: undo.scans.clone() }.apply(&mut viewpoints, made.0.revision);
        let mut trajectory = self.map.trajectory.write();
        trajectory.withdraw(undo.changes(), made.0.revision);
        if let Some(request) = &undo.request {
            self.remember(CompletedRequest::of_undo(request, undo, &made.0));
        }
        Some(self.publish(made))
    }

    /// Puts or ends a keep-out; always makes a revision. The lock of the keep-outs is held until that is published, for
    /// some instructions, so that no reader sees one without the other. No voxel changes, so no shard is locked.
    fn change_keep_outs(self, KeepOutRecord { change, request }: &KeepOutRecord) -> Made {
        let before = self.unchanged();
        let committed = Committed { revision: before.revision + 1, ..before };
        let changed = Arc::new(self.map.keep_outs().after(change, committed.revision));
        let mut keep_outs = self.map.keep_outs.write();
        *keep_outs = changed;
        if let Some(request) = request {
            self.remember(CompletedRequest::of_keep_out(request, &committed));
        }
        self.publish((committed, LevelChange::of(self.noted, [])))
    }

    /// Thins the trajectory before the revision `before`, see [`Trajectory::thin`](crate::map::Trajectory::thin); the
    /// number of poses that went. Makes no revision. Readers go on meanwhile.
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
    fn publish(&self, made: Made) -> Made {
        self.map.published.publish(made.0.version());
        made
    }

    /// What the change is once it is made: the next revision, and what was noted of it.
    fn next(&self, update: &mut MapUpdate) -> Made {
        let ContentVersion { revision, hash } = self.map.content_version();
        let MapUpdate { added, removed, shards } = update;
        let committed = Committed {
            revision: revision + 1,
            hash: hash.with(added.hash).without(removed.hash),
            added: added.voxels,
            removed: removed.voxels,
        };
        let noted = shards.iter_mut().flat_map(|(_, update)| std::mem::take(&mut update.noted));
        (committed, LevelChange::of(self.noted, noted))
    }

    /// The map as it is.
    fn unchanged(&self) -> Committed {
        Committed::none(self.map.content_version())
    }

    /// Finds out what it comes to that voxels go and others come, and builds what it needs, while readers go on; none
    /// once stopped.
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
        let wanted =
            Wanted { levels: self.noted, moments: self.map.moments.is_some(), blocks: self.followed };
        let plan = |i: usize| (i, ShardUpdate::plan(&self.map.shards[i].read(), &by_shard[i], wanted, stop));
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

    /// The moments of points that come.
    fn adding(&self, moments: &MomentSet) -> Gained {
        Gained { added: self.grouped(moments), ..Gained::default() }
    }

    /// Moments shard by shard; none in a map that keeps none.
    fn grouped(&self, moments: &MomentSet) -> [MomentsOfShard; SHARDS] {
        self.map.moments.as_ref().map(|kept| kept.group(moments)).unwrap_or_default()
    }

    /// Does what is planned under the write locks, which are taken in ascending order. Moments of voxels that lose
    /// descendants are rebuilt from what remains, before others are `gained`. None once stopped.
    fn carry_out(&self, update: MapUpdate, gained: Gained, stop: StopSignal<'_>) -> Option<Locks<'a>> {
        let no_long_read = self.map.long_reads.write();
        let lost = update.shards.iter().map(|(i, update)| (*i, &update.moments));
        let Gained { added, known } = &gained;
        let moments = self.map.moments.as_ref().map(|kept| kept.change(lost, added, known, stop));
        let (mut emptied, mut touched) = (Vec::new(), TouchedBlocks::default());
        let lock = |(i, update): (usize, ShardUpdate)| {
            let mut shard = self.map.shards[i].write();
            touched.extend(&update.touched);
            emptied.extend(update.apply(&mut shard, &self.map.settings));
            shard
        };
        let shards = update.shards.into_iter().map(lock).collect();
        self.tell(touched);
        let locks = Locks {
            _shards: shards,
            _moments: moments.unwrap_or_default(),
            _no_long_read: no_long_read,
            _emptied: emptied,
        };
        (!stop.is_stopped()).then_some(locks)
    }

    /// Tells the followers which blocks changed, and those who came while it was planned that they do not know.
    fn tell(&self, touched: TouchedBlocks) {
        let touched = if self.followed { touched } else { TouchedBlocks::everything() };
        self.map.followers.tell(touched);
    }
}

/// Viewpoints that come and go with a change.
#[derive(Debug, Clone, Default)]
pub struct ViewpointChange {
    /// The one that the change's scan left.
    pub left: Option<Arc<Viewpoint>>,
    /// The revisions of the scans whose viewpoints go, where they are there.
    pub gone: Vec<u64>,
}

impl ViewpointChange {
    /// Makes the change of revision `revision`. Holders of the viewpoints as they were keep them.
    fn apply(self, viewpoints: &mut Arc<ViewpointSet>, revision: u64) {
        if self.left.is_none() && self.gone.iter().all(|&gone| viewpoints.get(gone).is_none()) {
            return;
        }
        let viewpoints = Arc::make_mut(viewpoints);
        self.gone.iter().for_each(|&gone| drop(viewpoints.remove(gone)));
        if let Some(viewpoint) = self.left {
            viewpoints.insert(revision, viewpoint);
        }
    }
}

/// A change that was made, and what it did to the levels that are noted.
type Made = (Committed, Vec<LevelChange>);

/// What is to be done to a map. A shard is as it was planned for until the change is carried out, since the turn to
/// change the map is held meanwhile.
struct MapUpdate {
    /// The finest voxels that go, and those that come.
    removed: Moved,
    added: Moved,
    /// Each with the number of its shard, ascending.
    shards: Vec<(usize, ShardUpdate)>,
}

/// Moments that a change brings, shard by shard.
#[derive(Default)]
struct Gained {
    /// Of points, which add to those that are there.
    added: [MomentsOfShard; SHARDS],
    /// Those that take the place of what is there.
    known: [MomentsOfShard; SHARDS],
}

/// Keeps readers of what changed waiting until the change is published.
struct Locks<'a> {
    _shards: Vec<RwLockWriteGuard<'a, Shard>>,
    _moments: MomentLocks<'a>,
    _no_long_read: RwLockWriteGuard<'a, ()>,
    /// What was in shards that lost everything: to give back its memory takes a while, so it comes last.
    _emptied: Vec<Shard>,
}

impl MultiResolutionMap {
    /// Waits for the turn to change the map.
    pub fn committer(&self) -> Committer<'_> {
        Committer::begin(self)
    }
}
