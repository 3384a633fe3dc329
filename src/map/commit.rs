//! How a map is changed: one change at a time, in the order of revisions.

use std::sync::atomic::Ordering;

use parking_lot::{MutexGuard, RwLockUpgradableReadGuard, RwLockWriteGuard};

use super::addition::Addition;
use super::shard::{Block, Shard};
use super::sharding::SHARDS;
use super::{MultiResolutionMap, ScanRecord, TrajectoryPose};
use crate::voxel::{BLOCK_LEVELS, VoxelSet};

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

    /// Adds a scan's voxels at every level and its pose to the trajectory; always makes a revision.
    pub fn insert_scan(self, scan: ScanRecord) -> Committed {
        let (_shards, voxels) = self.add_to_shards(&scan.voxels);
        let mut trajectory = self.map.trajectory.write();
        let revision = self.map.revision() + 1;
        trajectory.push(TrajectoryPose { revision, new_voxels: voxels, ..scan.pose });
        self.publish(revision, voxels)
    }

    /// Adds finest voxels, with neither pose nor revision: what [`MultiResolutionMap::restore`] begins with.
    pub(super) fn add(self, voxels: &VoxelSet) {
        self.add_to_shards(voxels);
    }

    /// Takes finest voxels out, and every coarser one that loses its last child. Voxels that are not there are
    /// passed over; removing none makes no revision.
    pub fn remove(self, voxels: &VoxelSet) -> Committed {
        let by_shard = self.group(voxels);
        let mut shards = self.lock(&by_shard);
        let removed = shards.iter_mut().map(|(i, shard)| shard.remove(&by_shard[*i])).sum();
        if removed == 0 {
            return Committed { revision: self.map.revision(), voxels: 0 };
        }
        shards.iter_mut().for_each(|(_, shard)| shard.reset_if_empty(&self.map.settings));
        self.publish(self.map.revision() + 1, removed)
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

    /// Adds voxels to their shards: the write locks, taken in ascending order, and the number of voxels that were
    /// absent. What is to be done is found out, and what has to grow is built, while readers go on; they wait only
    /// while it is done.
    fn add_to_shards(&self, voxels: &VoxelSet) -> (Vec<RwLockWriteGuard<'a, Shard>>, usize) {
        let by_shard = self.group(voxels);
        let touched = self.map.shards.iter().zip(&by_shard).filter(|(_, blocks)| !blocks.is_empty());
        let planned: Vec<_> = touched
            .map(|(shard, blocks)| {
                let shard = shard.upgradable_read();
                let addition = Addition::plan(&shard, blocks);
                (shard, addition)
            })
            .collect();
        let mut added = 0;
        let locked = planned.into_iter().map(|(shard, addition)| {
            let mut shard = RwLockUpgradableReadGuard::upgrade(shard);
            added += addition.apply(&mut shard);
            shard
        });
        (locked.collect(), added)
    }

    fn lock(&self, by_shard: &[Vec<&Block>; SHARDS]) -> Vec<(usize, RwLockWriteGuard<'a, Shard>)> {
        let touched = (0..SHARDS).filter(|&i| !by_shard[i].is_empty());
        touched.map(|i| (i, self.map.shards[i].write())).collect()
    }
}
