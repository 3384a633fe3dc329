//! How a map is changed: one change at a time, in the order of revisions.

use std::sync::atomic::Ordering;

use parking_lot::{MutexGuard, RwLockUpgradableReadGuard, RwLockWriteGuard};

use super::addition::Addition;
use super::shard::{Block, Shard};
use super::sharding::SHARDS;
use super::{AnsweredRequest, Change, MultiResolutionMap, Request, ScanRecord, TrajectoryPose, UndoRecord};
use crate::voxel::{BLOCK_LEVELS, MOMENT_LEVEL, MomentSet, Moments, VoxelKey, VoxelSet};

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
    /// Finest voxels added or removed.
    pub voxels: usize,
}

impl<'a> Committer<'a> {
    pub(super) fn begin(map: &'a MultiResolutionMap) -> Self {
        Self { map, _turn: map.committing.lock() }
    }

    /// The map, which nobody else changes meanwhile.
    pub fn map(&self) -> &'a MultiResolutionMap {
        self.map
    }

    /// Makes `change`, for the first time or again.
    pub fn apply(self, change: &Change) -> Committed {
        match change {
            Change::Insertion(scan) => self.insert(scan),
            Change::Deletion(deletion) => self.delete(&deletion.voxels, deletion.request.as_ref()),
            Change::Undo(undo) => self.undo(undo),
        }
    }

    /// Adds a scan's voxels at every level and its pose to the trajectory; always makes a revision.
    pub fn insert_scan(self, scan: ScanRecord) -> Committed {
        self.insert(&scan)
    }

    fn insert(self, scan: &ScanRecord) -> Committed {
        let (_shards, voxels) = self.add_to_shards(&scan.voxels, &scan.moments);
        let mut trajectory = self.map.trajectory.write();
        let revision = self.map.revision() + 1;
        trajectory.push(TrajectoryPose { revision, new_voxels: voxels, ..scan.pose.clone() });
        self.publish(revision, voxels)
    }

    /// Adds finest voxels and moments, with neither pose nor revision: what [`MultiResolutionMap::restore`] begins
    /// with.
    pub(super) fn add(self, voxels: &VoxelSet, moments: &MomentSet) {
        self.add_to_shards(voxels, moments);
    }

    /// Takes finest voxels out, and every coarser one that loses its last child. Voxels that are not there are
    /// passed over; removing none makes no revision.
    pub fn remove(self, voxels: &VoxelSet) -> Committed {
        self.delete(voxels, None)
    }

    fn delete(self, voxels: &VoxelSet, request: Option<&Request>) -> Committed {
        let by_shard = self.group(voxels);
        let mut shards = self.lock(&by_shard);
        let removed = shards.iter_mut().map(|(i, shard)| shard.remove(&by_shard[*i])).sum();
        if removed == 0 {
            return Committed { revision: self.map.revision(), voxels: 0 };
        }
        shards.iter_mut().for_each(|(_, shard)| shard.reset_if_empty(&self.map.settings));
        let committed = Committed { revision: self.map.revision() + 1, voxels: removed };
        self.remember(request, committed, 0);
        self.publish(committed.revision, committed.voxels)
    }

    /// Takes scans out of the trajectory, and the voxels that they alone held; always makes a revision.
    fn undo(self, undo: &UndoRecord) -> Committed {
        let by_shard = self.group(&undo.voxels);
        // All of them, so that nobody who has a view of the whole map sees the trajectory change.
        let mut shards: Vec<_> = self.map.shards.iter().map(|shard| shard.write()).collect();
        let mut trajectory = self.map.trajectory.write();
        let removed = shards.iter_mut().zip(&by_shard).map(|(shard, blocks)| shard.remove(blocks)).sum();
        for (shard, moments) in shards.iter_mut().zip(self.group_moments(&undo.moments)) {
            shard.set_moments(&moments);
            shard.reset_if_empty(&self.map.settings);
        }
        let committed = Committed { revision: self.map.revision() + 1, voxels: removed };
        trajectory.withdraw(&undo.scans, committed.revision);
        self.remember(undo.request.as_ref(), committed, undo.scans.len());
        self.publish(committed.revision, committed.voxels)
    }

    fn remember(&self, request: Option<&Request>, Committed { revision, voxels }: Committed, scans: usize) {
        if let Some(Request { id, digest }) = request.cloned() {
            self.map.requests.write().push(AnsweredRequest { id, digest, revision, voxels, scans });
        }
    }

    /// Makes the change visible: readers that get a lock from now on report this revision.
    fn publish(&self, revision: u64, voxels: usize) -> Committed {
        self.map.revision.store(revision, Ordering::Release);
        Committed { revision, voxels }
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

    /// The moments of `set`, shard by shard.
    fn group_moments(&self, set: &MomentSet) -> [Vec<(VoxelKey, Moments)>; SHARDS] {
        let mut by_shard: [Vec<_>; SHARDS] = Default::default();
        for &(voxel, moments) in set.as_slice() {
            by_shard[self.map.sharding.shard_of(voxel.index(), MOMENT_LEVEL)].push((voxel, moments));
        }
        by_shard
    }

    /// Adds voxels and the moments of points in them to their shards: the write locks, taken in ascending order, and
    /// the number of voxels that were absent. What is to be done is found out, and what has to grow is built, while
    /// readers go on; they wait only while it is done.
    fn add_to_shards(
        &self,
        voxels: &VoxelSet,
        moments: &MomentSet,
    ) -> (Vec<RwLockWriteGuard<'a, Shard>>, usize) {
        let (by_shard, moments) = (self.group(voxels), self.group_moments(moments));
        let touched = (0..SHARDS).filter(|&i| !by_shard[i].is_empty());
        let planned: Vec<_> = touched
            .map(|i| {
                let shard = self.map.shards[i].upgradable_read();
                let addition = Addition::plan(&shard, &by_shard[i]);
                (i, shard, addition)
            })
            .collect();
        let mut added = 0;
        let locked = planned.into_iter().map(|(i, shard, addition)| {
            let mut shard = RwLockUpgradableReadGuard::upgrade(shard);
            added += addition.apply(&mut shard);
            shard.add_moments(&moments[i]);
            shard
        });
        (locked.collect(), added)
    }

    fn lock(&self, by_shard: &[Vec<&Block>; SHARDS]) -> Vec<(usize, RwLockWriteGuard<'a, Shard>)> {
        let touched = (0..SHARDS).filter(|&i| !by_shard[i].is_empty());
        touched.map(|i| (i, self.map.shards[i].write())).collect()
    }
}
