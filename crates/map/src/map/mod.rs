//! The map: occupied voxel lists at many resolutions behind counting Bloom filters (paper II, III), in shards
//! behind locks.
//!
//! Reading order: [`OccupiedVoxelList`] is one level of the paper, `shard` all levels of one part of space,
//! [`MultiResolutionMap`] the shards, [`view`] how it is read and [`commit`] how it is changed.

mod block_change;
mod bounds;
mod bulk;
mod capacity_schedule;
mod cell_bounds;
mod cell_box;
mod change;
pub mod commit;
mod committed;
mod content_hash;
mod contents;
mod distance_block;
mod filter_room;
mod followers;
mod frustum;
mod idempotency_log;
mod info;
mod keep_out;
mod level_block;
mod level_blocks;
mod level_changes;
mod level_moves;
mod level_update;
mod level_voxels;
pub mod lookup;
mod moments;
mod name;
mod occupied_voxel_list;
mod published;
mod region;
mod selected;
mod settings;
mod shard;
mod shard_level;
mod sharding;
mod tier_view;
mod trajectory;
mod update;
pub mod view;
mod voxel_ownership;
mod voxel_selection;

pub(crate) use cell_bounds::CellBounds;
pub use cell_box::CellBox;
pub use change::{Change, DeletionRecord, KeepOutRecord, Request, UndoRecord};
pub use commit::{Committer, ViewpointChange};
pub use committed::Committed;
pub use content_hash::{ContentHash, ContentVersion};
pub use contents::{ContentsError, MapContents, REVISION_MAX};
pub use distance_block::{DISTANCE_CAP_MAX, DistanceBlock, margin_of};
pub use followers::{BlockFollower, TouchedBlocks};
pub use frustum::{Frustum, FrustumError};
pub use idempotency_log::{
    CompletedRequest, IdempotencyLog, REQUESTS_KEPT, REQUESTS_PER_CALLER_KEPT, RequestKind,
};
pub use info::{FilterInfo, LevelInfo, MapDescription};
#[cfg(test)]
pub(crate) use keep_out::test_shapes;
pub use keep_out::{
    KEEP_OUTS_MAX, KeepOut, KeepOutAct, KeepOutChange, KeepOutShape, KeepOutShapeError, KeepOuts,
    KeepOutsFull, Outline, PRISM_CORNERS_MAX, Prism, PrismError, ShapeRay, TooManyVoxels,
};
pub use level_blocks::blocks_in;
pub use level_changes::{LevelChange, LevelSet};
pub use level_voxels::LevelVoxels;
pub use lookup::Lookup;
pub use moments::MomentsView;
pub use name::{
    CallerName, KeepOutName, MapName, NAME_LENGTH_MAX, NameError, RequestId, RobotName, SessionName,
};
pub use occupied_voxel_list::OccupiedVoxelList;
pub use region::{OrientedBox, REGION_M_MAX, Region, RegionError};
pub use settings::{LEVELS_DEFAULT, MapSettings, MapSettingsError};
pub use sharding::SHARDS;
pub(crate) use tier_view::TierView;
pub use trajectory::{
    ForgottenIds, ID_RANGES_PER_SESSION_MAX, KnownScan, MappedScan, OverlapOfNoLevel, SESSIONS_PER_ROBOT_MAX,
    ScanRecord, Trajectory, TrajectorySpacing, ViewpointRecord, WithdrawnChange,
};
pub use view::{LongRead, MapView};
pub use voxel_ownership::{Reversal, VoxelOwnership};
pub use voxel_selection::VoxelSelection;

use std::sync::Arc;

use crate::sync::{Mutex, Rank, RwLock, RwLockReadGuard};
use crate::visibility::ViewpointSet;
use crate::voxel::{Cell, Lattice, MOMENT_LEVEL, Moments, VoxelKey};
use followers::Followers;
use moments::ShardedMoments;
use published::Published;
use shard::Shard;
use sharding::Sharding;

/// A multi-resolution occupied voxel list (MROL, paper III): level n holds the occupied voxels of
/// r_n = r_0 * 2^n, with the trajectory of the poses from which they were seen.
///
/// Space is cut into regions, and each region belongs to one of [`SHARDS`] shards with a lock of its own:
/// readers hold the read locks of the shards they need, all at once, and so see one revision. Changes are made
/// one at a time by a [`Committer`], which holds the write locks of the shards it touches until the new
/// revision is published.
#[derive(Debug)]
pub struct MultiResolutionMap {
    settings: MapSettings,
    lattice: Lattice,
    sharding: Sharding,
    /// None of a map that keeps no moments.
    moments: Option<ShardedMoments>,
    shards: [RwLock<Shard>; SHARDS],
    trajectory: RwLock<Trajectory>,
    requests: RwLock<IdempotencyLog>,
    keep_outs: RwLock<Arc<KeepOuts>>,
    viewpoints: RwLock<Arc<ViewpointSet>>,
    published: Published,
    followers: Followers,
    commit_queue: Mutex<()>,
    /// Held by who reads for long; see [`MultiResolutionMap::long_view`].
    long_reads: RwLock<()>,
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

    /// The poses of the accepted scans, as they are now. Nobody waits for who holds them.
    pub fn trajectory(&self) -> Trajectory {
        self.trajectory.read().clone()
    }

    /// The poses of the accepted scans, with a version of the map at which they are these.
    pub fn trajectory_and_version(&self) -> (Trajectory, ContentVersion) {
        // Who adds a pose publishes its revision before others may read.
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
        // Who changes them publishes the revision before others may read.
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

    /// The moments of the centers of the finest voxels in a voxel of [`MOMENT_LEVEL`], which stand for points that are not
    /// known; none where there is no voxel. Locks one shard.
    pub(crate) fn center_moments(&self, voxel: VoxelKey) -> Option<Moments> {
        let (block, cell) = Cell::of(voxel.index().map(|i| i << MOMENT_LEVEL));
        let shard = self.shards[self.sharding.shard_of(voxel.index(), MOMENT_LEVEL)].read();
        let word = shard.level(0).blocks().get(block).0[cell.word()];
        (word != 0).then(|| Moments::of_descendants(word))
    }

    /// Follows which blocks change from now on, for what is derived of the voxels. Changes cost a little more meanwhile.
    pub fn follow_blocks(&self) -> BlockFollower {
        self.followers.add()
    }
}
