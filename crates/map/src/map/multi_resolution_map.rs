//! The map: all its shards, and what else it holds.

use std::sync::Arc;

use super::change::{BlockFollower, Followers, IdempotencyLog, Published};
use super::content_hash::ContentVersion;
use super::keep_out::KeepOuts;
use super::moments::{MomentsView, ShardedMoments};
use super::settings::{MapSettings, MapSettingsError};
use super::shards::{SHARDS, Shard, Sharding};
use super::trajectory::Trajectory;
use crate::sync::{Mutex, Rank, RwLock, RwLockReadGuard};
use crate::visibility::ViewpointSet;
use crate::voxel::{Cell, Lattice, MOMENT_LEVEL, Moments, VoxelKey};

/// A multi-resolution occupied voxel list (MROL, paper III): level n holds the occupied voxels of
/// r_n = r_0 * 2^n, with the trajectory of the poses from which they were seen.
///
/// Space is cut into regions, and each region belongs to one of [`SHARDS`] shards with a lock of its own: readers hold
/// the read locks of the shards they need, all at once, and so see one revision. Changes are made one at a time by a
/// [`Committer`](super::Committer), which holds the write locks of the shards it touches until the new revision is
/// published.
#[derive(Debug)]
pub struct MultiResolutionMap {
    pub(super) settings: MapSettings,
    pub(super) lattice: Lattice,
    pub(super) sharding: Sharding,
    /// None of a map that keeps no moments.
    pub(super) moments: Option<ShardedMoments>,
    pub(super) shards: [RwLock<Shard>; SHARDS],
    pub(super) trajectory: RwLock<Trajectory>,
    pub(super) requests: RwLock<IdempotencyLog>,
    pub(super) keep_outs: RwLock<Arc<KeepOuts>>,
    pub(super) viewpoints: RwLock<Arc<ViewpointSet>>,
    pub(super) published: Published,
    pub(super) followers: Followers,
    pub(super) commit_queue: Mutex<()>,
    /// Held by long reads; see [`MultiResolutionMap::long_read`].
    pub(super) long_reads: RwLock<()>,
}

impl MultiResolutionMap {
    /// An empty map at revision 0.
    ///
    /// # Errors
    /// When a setting is out of range; the error names it and the range.
    pub fn new(settings: MapSettings) -> Result<Self, MapSettingsError> {
        let (lattice, sharding) = (settings.lattice()?, Sharding::new(settings.levels));
        Ok(Self {
            settings,
            lattice,
            sharding,
            moments: settings.moments.then(|| ShardedMoments::new(sharding)),
            shards: std::array::from_fn(|i| RwLock::new(Rank::Shard(i as u8), Shard::new(i, &settings))),
            trajectory: RwLock::new(Rank::Trajectory, Trajectory::default()),
            requests: RwLock::new(Rank::Requests, IdempotencyLog::default()),
            keep_outs: RwLock::new(Rank::KeepOuts, Arc::default()),
            viewpoints: RwLock::new(Rank::Viewpoints, Arc::default()),
            published: Published::default(),
            followers: Followers::default(),
            commit_queue: Mutex::new(Rank::Commit, ()),
            long_reads: RwLock::new(Rank::LongRead, ()),
        })
    }

    /// What the map was made with.
    pub fn settings(&self) -> &MapSettings {
        &self.settings
    }

    /// The lattices of the map's levels.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Committed changes so far.
    pub fn revision(&self) -> u64 {
        self.published.revision()
    }

    /// The newest revision, with the hash of what the map holds then.
    pub fn content_version(&self) -> ContentVersion {
        self.published.read()
    }

    /// Number of occupied voxels of `level`.
    pub fn voxels(&self, level: u32) -> usize {
        self.shards.iter().map(|shard| shard.read().level(level).len()).sum()
    }

    /// True without an occupied voxel.
    pub fn is_empty(&self) -> bool {
        self.shards.iter().all(|shard| shard.read().is_empty())
    }

    /// The poses of the accepted scans, as they are now. Nothing waits for their holders.
    pub fn trajectory(&self) -> Trajectory {
        self.trajectory.read().clone()
    }

    /// The poses of the accepted scans, with a version of the map at which they are these.
    pub fn trajectory_and_version(&self) -> (Trajectory, ContentVersion) {
        // A pose is added and its revision published before others may read.
        let trajectory = self.trajectory.read();
        (trajectory.clone(), self.content_version())
    }

    /// The poses of the accepted scans, where they do not change just now: for threads that may not wait.
    pub fn try_trajectory(&self) -> Option<RwLockReadGuard<'_, Trajectory>> {
        self.trajectory.try_read()
    }

    /// The keep-outs, as they are now.
    pub fn keep_outs(&self) -> Arc<KeepOuts> {
        Arc::clone(&self.keep_outs.read())
    }

    /// The keep-outs, where they do not change just now: for threads that may not wait.
    pub fn try_keep_outs(&self) -> Option<Arc<KeepOuts>> {
        self.keep_outs.try_read().map(|keep_outs| Arc::clone(&keep_outs))
    }

    /// The keep-outs, with a version of the map at which they are these.
    pub fn keep_outs_and_version(&self) -> (Arc<KeepOuts>, ContentVersion) {
        // They are changed and the revision published before others may read.
        let keep_outs = self.keep_outs.read();
        (Arc::clone(&keep_outs), self.content_version())
    }

    /// Where scans saw through, as they are now.
    pub fn viewpoints(&self) -> Arc<ViewpointSet> {
        Arc::clone(&self.viewpoints.read())
    }

    /// Answers to changes that were asked for under an id.
    pub fn requests(&self) -> RwLockReadGuard<'_, IdempotencyLog> {
        self.requests.read()
    }

    /// Locks the moments of the map's points for reading, at one revision; before a view of the voxels, where both
    /// are needed. None of a map that keeps no moments.
    pub fn moments(&self) -> Option<MomentsView<'_>> {
        self.moments.as_ref().map(ShardedMoments::view)
    }

    /// The moments of the centers of the finest voxels in a voxel of [`MOMENT_LEVEL`], which stand for points that are
    /// not known; none where there is no voxel. Locks one shard.
    pub(crate) fn center_moments(&self, voxel: VoxelKey) -> Option<Moments> {
        let (block, cell) = Cell::of(voxel.index().map(|i| i << MOMENT_LEVEL));
        let shard = self.shards[self.sharding.shard_of(voxel.index(), MOMENT_LEVEL)].read();
        let word = shard.level(0).blocks().get(block).0[cell.word()];
        (word != 0).then(|| Moments::of_descendants(word))
    }

    /// Follows which blocks change from now on, for what is derived of the voxels. Changes cost a little more
    /// meanwhile.
    pub fn follow_blocks(&self) -> BlockFollower {
        self.followers.add()
    }
}
