//! The map: occupied voxel lists at many resolutions behind counting Bloom filters (paper II, III), in shards
//! behind locks.
//!
//! Reading order: [`OccupiedVoxelList`] is one level of the paper, `shard` all levels of one part of space,
//! [`MultiResolutionMap`] the shards, [`view`] how it is read and [`commit`] how it is changed.

mod block_change;
mod bounds;
mod bulk;
mod capacity_schedule;
mod change;
pub mod commit;
mod committed;
mod content_hash;
mod contents;
mod filter_room;
mod followers;
mod idempotency_log;
mod info;
mod level_block;
mod level_blocks;
mod level_changes;
mod level_update;
mod level_voxels;
pub(crate) mod lookup;
mod moments;
mod name;
mod occupied_voxel_list;
mod published;
mod region;
mod settings;
mod shard;
mod sharding;
mod trajectory;
mod update;
pub mod view;
mod voxel_ownership;

pub use change::{Change, DeletionRecord, Request, UndoRecord};
pub use commit::Committer;
pub use committed::Committed;
pub use content_hash::{ContentHash, ContentVersion};
pub use contents::{ContentsError, MapContents, REVISION_MAX};
pub use followers::{BlockFollower, TouchedBlocks};
pub use idempotency_log::{
    CompletedRequest, IdempotencyLog, REQUESTS_KEPT, REQUESTS_PER_CALLER_KEPT, RequestKind,
};
pub use info::{LevelInfo, MapDescription};
pub use level_changes::{LevelChange, LevelSet};
pub use level_voxels::LevelVoxels;
pub use lookup::Lookup;
pub use moments::MomentsView;
pub use name::{CallerName, MapName, NAME_LENGTH_MAX, NameError, RequestId, RobotName, SessionName};
pub use occupied_voxel_list::OccupiedVoxelList;
pub use region::{Region, RegionError, SPHERE_M_MAX};
pub use settings::{LEVELS_DEFAULT, MapSettings, MapSettingsError};
pub use sharding::SHARDS;
pub use trajectory::{
    ForgottenIds, ID_RANGES_PER_SESSION_MAX, KnownScan, MappedScan, OverlapOfNoLevel, SESSIONS_PER_ROBOT_MAX,
    ScanRecord, Trajectory, TrajectorySpacing, WithdrawnChange,
};
pub use view::{LongRead, MapView};
pub use voxel_ownership::{Reversal, VoxelOwnership};

use crate::geometry::{Point, Pose};
use crate::sync::{Mutex, Rank, RwLock, RwLockReadGuard};
use crate::voxel::Lattice;
use followers::Followers;
use moments::ShardedMoments;
use published::Published;
use shard::Shard;
use sharding::{Sharding, ShardsTouched};

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
    moments: ShardedMoments,
    shards: [RwLock<Shard>; SHARDS],
    trajectory: RwLock<Trajectory>,
    requests: RwLock<IdempotencyLog>,
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
            moments: ShardedMoments::new(sharding),
            shards: std::array::from_fn(|i| RwLock::new(Rank::Shard(i as u8), Shard::new(i, &settings))),
            trajectory: RwLock::new(Rank::Trajectory, Trajectory::default()),
            requests: RwLock::new(Rank::Requests, IdempotencyLog::default()),
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

    /// Answers to changes that were asked for under an id.
    pub fn requests(&self) -> RwLockReadGuard<'_, IdempotencyLog> {
        self.requests.read()
    }

    /// Locks the whole map for reading, at one revision. For a few milliseconds at most: whoever reads for longer
    /// begins with [`MultiResolutionMap::long_read`].
    pub fn view(&self) -> MapView<'_> {
        MapView::lock(self, ShardsTouched::all())
    }

    /// Keeps changes from beginning to take their locks, for a read that takes longer than a few milliseconds. Changes
    /// wait for it, and for no other: a long read that comes while one waits goes behind it. Readers of
    /// [`MultiResolutionMap::view`] and [`MultiResolutionMap::view_of`] wait for neither.
    pub fn long_read(&self) -> LongRead<'_> {
        LongRead { _changes_wait: self.long_reads.read(), map: self }
    }

    /// Locks what `points`, placed at `map_from_points`, can fall in.
    pub fn view_of(&self, points: &[Point], map_from_points: &Pose) -> MapView<'_> {
        MapView::lock(self, self.sharding.touched_by(points, map_from_points, &self.lattice))
    }

    /// [`MultiResolutionMap::view_of`] where no lock has to be waited for; none elsewhere. For threads that may not
    /// wait.
    pub fn try_view_of(&self, points: &[Point], map_from_points: &Pose) -> Option<MapView<'_>> {
        MapView::try_lock(self, self.sharding.touched_by(points, map_from_points, &self.lattice))
    }

    /// Locks the moments of the map's points for reading, at one revision; before a view of the voxels, where both
    /// are needed.
    pub fn moments(&self) -> MomentsView<'_> {
        self.moments.view()
    }

    /// Follows which blocks change from now on, for what is derived of the voxels. Changes cost a little more meanwhile.
    pub fn follow_blocks(&self) -> BlockFollower {
        self.followers.add()
    }

    /// Waits for the turn to change the map.
    pub fn committer(&self) -> Committer<'_> {
        Committer::begin(self)
    }
}
