//! A map under a name: what the service keeps about it besides the map itself.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use parking_lot::RwLock;
use tokio::sync::oneshot;
use uuid::Uuid;

use super::followers::Followers;
use super::keep_out_expiry::KeepOutExpiry;
use super::robots::Robots;
use super::snapshots::Snapshots;
use crate::cluster::NoRoom;
use crate::commit::{CommitQueue, CommitThreads, Lead, Stop};
use crate::error::{Reason, ServiceError};
use crate::request::{MapInfo, MapStorage, MapVersion};
use crate::work::ended_early;
use mrol_map::map::{ContentHistory, ContentVersion, MapName, MultiResolutionMap};
use mrol_map::planning::Planner;
use mrol_map::util::StopSignal;
use mrol_store::{FolderUse, MapFolder, OpenedMap, StoreError, StoreSettings};

/// A named map and those that wait for it.
#[derive(Debug)]
pub(crate) struct HostedMap {
    pub(crate) name: MapName,
    pub(crate) uuid: Uuid,
    pub(crate) map: Arc<MultiResolutionMap>,
    /// What keeps it across restarts, where anything does.
    pub(crate) folder: Option<Arc<MapFolder>>,
    pub(crate) commit_queue: CommitQueue,
    pub(crate) followers: Followers,
    pub(crate) robots: Arc<Robots>,
    /// What makes checks of bodies fast, once somebody asked for one.
    pub(crate) planner: OnceLock<Planner>,
    /// One undo is found out and made before the next is looked at.
    pub(crate) undo_lock: Arc<tokio::sync::Mutex<()>>,
    pub(super) snapshots: Snapshots,
    pub(crate) keep_out_expiry: KeepOutExpiry,
    /// Another node that holds the map and has no room for more of it.
    no_room: RwLock<Option<NoRoom>>,
    last_use: LastUse,
}

/// What is left of a map that was closed.
pub(super) struct Closed {
    pub(super) robots: Arc<Robots>,
    /// Hears when its files are closed.
    pub(super) done: oneshot::Receiver<()>,
}

/// When a map was last asked for: milliseconds since it was opened.
#[derive(Debug)]
struct LastUse {
    opened: Instant,
    at_ms: AtomicU64,
}

/// Absent neighbors of occupied voxels on which a description measures each level's false positives.
pub(crate) const RATE_SAMPLES: usize = 4096;
/// Seed of the sample on which false positives are measured: the same map gives the same figures.
const RATE_SEED: u64 = 1;

impl HostedMap {
    /// Takes a map into service; `threads` make its changes.
    pub(crate) fn new(
        threads: &Arc<CommitThreads>,
        name: MapName,
        uuid: Uuid,
        map: impl Into<Arc<MultiResolutionMap>>,
        folder: Option<MapFolder>,
        settings: &StoreSettings,
    ) -> Self {
        let map = map.into();
        let history = ContentHistory::of(map.content_version(), map.state_hash());
        Self::of_shared(threads, name, uuid, map, history, folder.map(Arc::new), settings)
    }

    /// Takes a map into service that was opened, with what is known of its robots; `threads` make its changes.
    pub(super) fn opened(
        threads: &Arc<CommitThreads>,
        name: MapName,
        opened: OpenedMap,
        robots: Arc<Robots>,
        settings: &StoreSettings,
    ) -> Self {
        let OpenedMap { uuid, map, history, folder, .. } = opened;
        let folder = Some(Arc::new(folder));
        let hosted = Self::of_shared(threads, name, uuid, Arc::new(map), history, folder, settings);
        Self { robots, ..hosted }
    }

    /// This map under the name `name`, once it has ended under its own.
    pub(super) fn again_as(
        &self,
        threads: &Arc<CommitThreads>,
        name: MapName,
        settings: &StoreSettings,
    ) -> Self {
        let (map, folder) = (Arc::clone(&self.map), self.folder.clone());
        let history = self.followers.recent.history();
        Self::of_shared(threads, name, self.uuid, map, history, folder, settings)
    }

    /// This map under the name `name` in the place of its own, with what is known of its robots.
    pub(super) fn renamed(
        &self,
        threads: &Arc<CommitThreads>,
        name: MapName,
        settings: &StoreSettings,
    ) -> Self {
        let renamed = self.again_as(threads, name, settings);
        Self { robots: Arc::clone(&self.robots), undo_lock: Arc::clone(&self.undo_lock), ..renamed }
    }

    fn of_shared(
        threads: &Arc<CommitThreads>,
        name: MapName,
        uuid: Uuid,
        map: Arc<MultiResolutionMap>,
        history: ContentHistory,
        folder: Option<Arc<MapFolder>>,
        settings: &StoreSettings,
    ) -> Self {
        let (followers, published) = Followers::new(map.revision(), history, settings.watch_bytes_max);
        let commit_queue =
            CommitQueue::begin(threads, name.clone(), Arc::clone(&map), folder.clone(), published, settings);
        Self {
            name,
            uuid,
            map,
            folder,
            commit_queue,
            followers,
            robots: Arc::default(),
            planner: OnceLock::new(),
            undo_lock: Arc::default(),
            snapshots: Snapshots::default(),
            keep_out_expiry: KeepOutExpiry::default(),
            no_room: RwLock::default(),
            last_use: LastUse { opened: Instant::now(), at_ms: AtomicU64::new(0) },
        }
    }

    /// Which node makes its changes.
    pub(crate) fn lead(&self) -> Lead {
        self.commit_queue.lead().borrow().clone()
    }

    /// Refuses what would take a map that nodes share away from its log.
    pub(super) fn check_not_shared(&self) -> Result<(), ServiceError> {
        if !matches!(self.lead(), Lead::Shared { .. }) {
            return Ok(());
        }
        let message =
            format!("several nodes share map {}: it is not renamed or replaced on one of them", self.name);
        Err(ServiceError::new(Reason::MapShared, message))
    }

    /// Notes that somebody asks for the map.
    pub(super) fn note_use(&self) {
        let LastUse { opened, at_ms } = &self.last_use;
        at_ms.store(opened.elapsed().as_millis() as u64, Ordering::Relaxed);
    }

    /// True where nobody has asked for the map for so long.
    pub(super) fn is_unused_for(&self, duration: Duration) -> bool {
        let LastUse { opened, at_ms } = &self.last_use;
        let last = Duration::from_millis(at_ms.load(Ordering::Relaxed));
        opened.elapsed().saturating_sub(last) >= duration
    }

    /// True where the map is at `revision`, no other node shares it, and nobody but its worker uses its files.
    pub(super) fn may_close(&self, revision: u64) -> bool {
        const OWN: usize = 2;
        let is_at_rest = self.map.revision() == revision && self.lead() == Lead::Alone;
        is_at_rest && self.folder.as_ref().is_some_and(|it| Arc::strong_count(it) == OWN)
    }

    /// Takes the map out of service. Its files are closed on a thread for commits.
    pub(super) fn close(self) -> Closed {
        let Self { commit_queue, robots, .. } = self;
        Closed { robots, done: commit_queue.close() }
    }

    /// Says which other node that holds the map has no room for more of it.
    pub(crate) fn set_no_room(&self, no_room: Option<NoRoom>) {
        *self.no_room.write() = no_room;
    }

    /// # Errors
    /// `DiskFull` and `MemoryFull` where another node that holds the map has no room for more of it.
    pub(crate) fn check_room_elsewhere(&self) -> Result<(), ServiceError> {
        self.no_room.read().as_ref().map_or(Ok(()), |no_room| Err(no_room.refusal(&self.name)))
    }

    /// Refuses changes that would be refused in the end, before any work is done for them.
    pub(crate) fn check_writable(&self) -> Result<(), ServiceError> {
        self.commit_queue.stopped().map_or(Ok(()), |stop| Err(stop.refusal(&self.name)))
    }

    /// Why there is nothing more to tell of this map.
    pub(crate) fn ended(&self) -> ServiceError {
        let gone = || ServiceError::new(Reason::MapNotFound, format!("map {} is gone", self.name));
        self.commit_queue.stopped().map_or_else(gone, |stop| stop.refusal(&self.name))
    }

    pub(crate) fn version(&self, ContentVersion { revision, hash }: ContentVersion) -> MapVersion {
        MapVersion { revision, map_uuid: self.uuid, content_hash: Some(hash) }
    }

    /// The map as it is.
    pub(crate) fn version_now(&self) -> MapVersion {
        self.version(self.map.content_version())
    }

    /// The map as it was at a revision, of which a change told before.
    pub(crate) fn version_at(&self, revision: u64) -> MapVersion {
        let now = self.version_now();
        let content_hash = now.content_hash.filter(|_| now.revision == revision);
        MapVersion { revision, content_hash, ..now }
    }

    /// Waits until `revision` is there. A waiter hears of the map's end at once.
    pub(crate) async fn wait_for_revision(
        &self,
        revision: u64,
        wait_max: Duration,
    ) -> Result<(), ServiceError> {
        if self.followers.wait_for_revision(revision, wait_max, &self.commit_queue).await {
            return Ok(());
        }
        match self.commit_queue.stopped() {
            Some(Stop::Failed(_) | Stop::Diverged(_)) | None => {}
            Some(stop) => return Err(stop.refusal(&self.name)),
        }
        let message = format!(
            "min_revision {revision} was not reached within {wait_max:?}: map {} is at {}",
            self.name,
            self.map.revision()
        );
        Err(ServiceError::new(Reason::RevisionNotReached, message))
    }

    pub(crate) fn check_level(&self, level: u32) -> Result<(), ServiceError> {
        let levels = self.map.settings().levels;
        if level < levels {
            return Ok(());
        }
        let message = format!("level must lie in 0..={} of map {}, got {level}", levels - 1, self.name);
        Err(ServiceError::new(Reason::LevelOutOfRange, message))
    }

    pub(crate) fn check_uuid(&self, uuid: Option<Uuid>) -> Result<(), ServiceError> {
        if uuid.is_none_or(|uuid| uuid == self.uuid) {
            return Ok(());
        }
        let message =
            format!("map_uuid of map {} is {}: it was deleted and made again", self.name, self.uuid);
        Err(ServiceError::new(Reason::MapReplaced, message))
    }

    pub(crate) fn describe(
        &self,
        rate_samples: usize,
        stop: StopSignal<'_>,
    ) -> Result<MapInfo, ServiceError> {
        let Some(described) = self.map.describe_until(rate_samples, RATE_SEED, stop) else {
            return Err(ended_early(stop));
        };
        let (storage, trajectory) = (self.storage(), self.map.trajectory());
        Ok(MapInfo {
            name: self.name.clone(),
            version: self.version(described.version),
            settings: *self.map.settings(),
            levels: described.levels,
            scans: usize::try_from(trajectory.scans()).unwrap_or(usize::MAX),
            poses: trajectory.len(),
            robots: trajectory.robots(),
            sightings: Vec::new(),
            set_bytes: described.set_bytes,
            moment_bytes: described.moment_bytes,
            commits: self.commit_queue.durations(),
            trajectory_bytes: described.trajectory_bytes,
            viewpoints: described.viewpoints,
            viewpoint_bytes: described.viewpoint_bytes,
            storage,
            is_asleep: false,
        })
    }

    /// Why the map takes no changes.
    pub(crate) fn failure(&self) -> Option<&str> {
        match self.commit_queue.stopped()? {
            Stop::Failed(reason) | Stop::Diverged(reason) | Stop::Behind(reason) => Some(reason),
            Stop::Deleted | Stop::HeldElsewhere | Stop::Replaced | Stop::Renamed => None,
        }
    }

    /// True where it takes no changes since this node has another history of it than the log of several nodes.
    pub(crate) fn has_diverged(&self) -> bool {
        matches!(self.commit_queue.stopped(), Some(Stop::Diverged(_)))
    }

    /// True where it takes no changes since the log of several nodes begins behind what this one has.
    pub(crate) fn is_behind_log(&self) -> bool {
        matches!(self.commit_queue.stopped(), Some(Stop::Behind(_)))
    }

    /// The journal cannot be read; that of a map that was deleted meanwhile need not be.
    pub(crate) fn unreadable(&self, error: &StoreError) -> ServiceError {
        match self.folder.as_deref().is_some_and(MapFolder::is_gone) {
            true => Stop::Deleted.refusal(&self.name),
            false => ServiceError::new(Reason::JournalUnreadable, error.to_string()),
        }
    }

    /// Of a map in memory only, of which `what` would need the journal.
    pub(crate) fn no_journal(&self, what: &str) -> ServiceError {
        let message =
            format!("map {} is kept in memory only: {what} needs the journal of a data folder", self.name);
        ServiceError::new(Reason::NoJournal, message)
    }

    fn storage(&self) -> Option<MapStorage> {
        let folder = self.folder.as_ref()?;
        let used: FolderUse = folder.used();
        let undo_from_revision = folder.undo_from(self.map.trajectory().withdrawn());
        Some(MapStorage {
            durable_revision: used.durable,
            snapshot_revision: used.snapshot,
            undo_from_revision,
            journal: used.journal,
            snapshot_age: used.snapshot_age,
            snapshot_failures: used.snapshot_failures,
            disk_bytes: used.disk_bytes,
            failure: self.failure().map(str::to_owned),
        })
    }
}
