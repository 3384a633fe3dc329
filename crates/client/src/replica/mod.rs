//! A copy of a map in this process, which follows the server's.
//!
//! ```no_run
//! use mrol::client::{Client, Replica, ReplicaOptions};
//! use mrol::map::MapName;
//! use mrol::service::PointQuery;
//!
//! # async fn example(query: PointQuery) -> Result<(), Box<dyn std::error::Error>> {
//! let client = Client::connect("http://127.0.0.1:7334").await?;
//! let replica = Replica::open(client, MapName::new("demo")?, ReplicaOptions::default()).await?;
//! let answer = replica.query_points(&query)?; // No call goes out.
//! println!("{} occupied at revision {}", answer.points_occupied, answer.version.revision);
//! # Ok(())
//! # }
//! ```

mod block;
mod copy;
mod follow;
mod question;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Duration;

use parking_lot::RwLock;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use uuid::Uuid;

use super::{Client, ClientError};
use copy::Copied;
use follow::Follower;
use mrol_map::bloom::FilterSettings;
use mrol_map::geometry::Pose;
use mrol_map::map::{ContentVersion, MapName, MultiResolutionMap, Region};
use mrol_map::planning::FIELD_BYTES_MAX_DEFAULT;
use mrol_map::util::StopSignal;
use mrol_map::voxel::VoxelKey;
use mrol_service::{PointAnswer, PointQuery, Reason, ServiceError};

/// Finest blocks that a replica may have where nobody says: those of 200 million voxels of a surface.
pub const BLOCKS_MAX_DEFAULT: usize = 16 << 20;

/// Bytes of viewpoints that a replica may have where nobody says: those of a map whose server was given four times as many as is
/// usual.
pub const VIEWPOINT_BYTES_MAX_DEFAULT: usize = 256 << 20;

/// What a replica copies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplicaOptions {
    /// The part of the map: voxels whose centers lie inside. The whole map without.
    pub region: Option<Region>,
    /// Most blocks of 8 x 8 x 8 finest voxels of the copy; 72 bytes each and what levels and filters take.
    /// [`BLOCKS_MAX_DEFAULT`].
    pub blocks_max: usize,
    /// Filters in front of the copy's levels, for [`Lookup::Bloom`](mrol_map::map::Lookup). None: the exact set answers, in a
    /// small part of the memory.
    pub filter: Option<FilterSettings>,
    /// Most bytes of the distance fields that the copy keeps for checks of bodies; less is slower, and as exact.
    /// [`FIELD_BYTES_MAX_DEFAULT`].
    pub field_bytes_max: usize,
    /// Most bytes of memory of the copy's viewpoints, by which it knows what is free. 0: it has none, and they are not sent.
    /// [`VIEWPOINT_BYTES_MAX_DEFAULT`].
    pub viewpoint_bytes_max: usize,
    /// How long the server may be silent until the connection counts as lost: more than its `watch_heartbeat_s`. 35 s.
    pub silence_max: Duration,
}

impl Default for ReplicaOptions {
    fn default() -> Self {
        let silence_max = Duration::from_secs(35);
        Self {
            region: None,
            blocks_max: BLOCKS_MAX_DEFAULT,
            filter: None,
            field_bytes_max: FIELD_BYTES_MAX_DEFAULT,
            viewpoint_bytes_max: VIEWPOINT_BYTES_MAX_DEFAULT,
            silence_max,
        }
    }
}

/// A copy of a map, or of a part of it, that follows the server's: it answers in this process, at a revision that it names.
///
/// A task of the runtime that opened it follows the map until the replica is dropped. Where the connection breaks it comes
/// back and goes on from the last revision, so that it misses nothing and tells nothing twice; meanwhile the copy answers as
/// it is. A map that was deleted and made again is another one, by its uuid, and is copied anew.
#[derive(Debug)]
pub struct Replica {
    shared: Arc<Shared>,
    region: Option<Region>,
    field_bytes_max: usize,
    following: JoinHandle<()>,
}

/// How far a replica is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReplicaStatus {
    /// The map that is copied.
    pub map_uuid: Uuid,
    /// The revision of the copy, with the hash of what it holds: that of the map where all of it is copied.
    pub version: ContentVersion,
    /// The newest revision that the server told of: the copy lags as far behind it.
    pub head_revision: u64,
    /// True while the server is telling of changes.
    pub is_connected: bool,
    /// How often the whole state was copied.
    pub resets: u64,
    /// Why the last watch ended, where it did.
    pub last_error: Option<String>,
}

/// Why a replica fails.
#[derive(Debug, thiserror::Error)]
pub enum ReplicaError {
    /// The server refused, or could not be reached.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// What the server sent makes no sense.
    #[error("the server's messages are damaged: {0}")]
    Damaged(String),
    /// The server sent nothing for so long, not even a heartbeat.
    #[error("the server was silent for {0:?}, silence_max of the replica")]
    Silent(Duration),
    /// The map has more blocks than the replica may have.
    #[error("the map has more than blocks_max, {0}, blocks: copy a region, or raise blocks_max")]
    TooLarge(usize),
    /// The map has more viewpoints than the replica may have.
    #[error(
        "the map's viewpoints take more than viewpoint_bytes_max, {0} bytes: raise it, or set it to 0 to copy none"
    )]
    TooManyViewpoints(usize),
    /// The question cannot be answered.
    #[error("{0}")]
    Question(#[from] ServiceError),
}

/// What the follower and the readers share.
#[derive(Debug)]
struct Shared {
    copied: RwLock<Copied>,
    status: watch::Sender<ReplicaStatus>,
}

impl Drop for Replica {
    fn drop(&mut self) {
        self.following.abort();
    }
}

impl Replica {
    /// Copies `map`, and follows it from then on; returns when the copy is complete.
    ///
    /// # Errors
    /// When the server refuses or cannot be reached, or the map is larger than the options allow.
    pub async fn open(client: Client, map: MapName, options: ReplicaOptions) -> Result<Self, ReplicaError> {
        let mut follower = Follower::new(client, map, options);
        let (shared, watched) = follower.copy_first().await?;
        let following = tokio::spawn(follower.run(Arc::clone(&shared), watched));
        Ok(Self { shared, region: options.region, field_bytes_max: options.field_bytes_max, following })
    }

    /// How far the replica is.
    pub fn status(&self) -> ReplicaStatus {
        self.shared.status.borrow().clone()
    }

    /// Follows how far the replica is.
    pub fn statuses(&self) -> watch::Receiver<ReplicaStatus> {
        self.shared.status.subscribe()
    }

    /// Waits until the copy has `revision` of the map that it copies.
    ///
    /// # Errors
    /// `DeadlineExceeded` where it does not come within `wait_max`.
    pub async fn wait_for_revision(&self, revision: u64, wait_max: Duration) -> Result<(), ReplicaError> {
        let mut statuses = self.statuses();
        let reached = statuses.wait_for(|status| status.version.revision >= revision);
        match tokio::time::timeout(wait_max, reached).await {
            Ok(Ok(_)) => Ok(()),
            _ => {
                let at = self.status().version.revision;
                let message =
                    format!("revision {revision} did not come within {wait_max:?}: the copy is at {at}");
                Err(ServiceError::new(Reason::RevisionNotReached, message).into())
            }
        }
    }

    /// The copy: all that a map answers can be asked of it. It changes as the server's does, and a view of it is of one
    /// revision. A map that was made again is another one: ask for it anew now and then.
    ///
    /// It has the map's viewpoints unless the options say otherwise, of a region those that looked into it. It has no moments, so
    /// that alignment finds poses by overlap alone, and no trajectory.
    pub fn map(&self) -> Arc<MultiResolutionMap> {
        Arc::clone(&self.shared.copied.read().map)
    }

    /// Says of each point whether its voxel is occupied, or with `keep_out` whether it lies in a keep-out, all at one
    /// revision; `min_revision` is not waited for.
    ///
    /// # Errors
    /// For a point in no voxel or outside of the region that is copied, named by its place; a level that is none; another
    /// uuid than the map's; a `min_revision` that the copy has not.
    pub fn query_points(&self, query: &PointQuery) -> Result<PointAnswer, ReplicaError> {
        let Copied { map, map_uuid, .. } = self.shared.copied.read().clone();
        check_level(query.level, &map)?;
        if query.map_uuid.is_some_and(|uuid| uuid != map_uuid) {
            let message = format!("map_uuid is {map_uuid}: the map was deleted and made again");
            return Err(ServiceError::new(Reason::MapReplaced, message).into());
        }
        self.check_region(query, &map)?;
        let map_from_points = query.map_from_points.unwrap_or_else(Pose::identity);
        let view = map.view_of(query.points.as_slice(), &map_from_points);
        let view = if query.keep_out { view.with_keep_outs() } else { view };
        if query.min_revision.is_some_and(|least| least > view.revision()) {
            let message = format!("min_revision was not reached: the copy is at {}", view.revision());
            return Err(ServiceError::new(Reason::RevisionNotReached, message).into());
        }
        let mut answer = query.answer_in(view, None, map_uuid, map.lattice(), StopSignal::NEVER)?;
        // The hash of a part is not the map's.
        answer.version.content_hash = answer.version.content_hash.filter(|_| self.region.is_none());
        Ok(answer)
    }

    /// Refuses points of whose voxels the replica knows nothing.
    fn check_region(&self, query: &PointQuery, map: &MultiResolutionMap) -> Result<(), ReplicaError> {
        let Some(region) = &self.region else { return Ok(()) };
        let lattice = map.lattice();
        let quantize = lattice.from_points(&query.map_from_points.unwrap_or_else(Pose::identity));
        // A region that holds the outermost finest voxels of a coarser one holds all of it.
        let is_outside = |point| {
            quantize.index(point).is_some_and(|index| {
                let first = index.map(|i| i >> query.level << query.level);
                let last = first.map(|i| i + ((1 << query.level) - 1));
                let corner = |n: usize| std::array::from_fn(|axis| [first, last][n >> axis & 1][axis]);
                let center = |voxel| lattice.center_m(voxel, 0);
                !(0..8).all(|n| VoxelKey::new(corner(n)).is_some_and(|voxel| region.contains(center(voxel))))
            })
        };
        let Some(place) = query.points.as_slice().iter().position(|&point| is_outside(point)) else {
            return Ok(());
        };
        let message = format!("points[{place}] is outside of the region that the replica copies");
        Err(ServiceError::new(Reason::PointOutOfRange, message).into())
    }
}

/// Refuses a level that the map has not.
fn check_level(level: u32, map: &MultiResolutionMap) -> Result<(), ReplicaError> {
    let levels = map.settings().levels;
    if level < levels {
        return Ok(());
    }
    let message = format!("level must lie in 0..={}, got {level}", levels - 1);
    Err(ServiceError::new(Reason::LevelOutOfRange, message).into())
}
