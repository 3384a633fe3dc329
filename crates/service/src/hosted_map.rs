//! A map under a name: what the service keeps about it besides the map itself.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use tokio::sync::{OwnedMutexGuard, watch};
use uuid::Uuid;

use super::commit_queue::{CommitQueue, CommitThread, Stop, Told};
use super::event_log::EventLog;
use super::full_state::FullStates;
use super::point_query::{POINTS_PER_STEP, point_without_voxel};
use super::recent_changes::RecentChanges;
use super::resource_budget::ResourceBudget;
use super::{
    Limits, ListingRequest, MapInfo, MapStorage, MapVersion, PointAnswer, PointQuery, Reason, ServiceError,
    VoxelListing, check_not_stopped, ended_early,
};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{ContentVersion, LongRead, MapName, MapView, MultiResolutionMap, RobotName};
use mrol_map::mapping::{LostRobots, Sightings};
use mrol_map::planning::Planner;
use mrol_map::sync::{Mutex, Rank};
use mrol_map::util::StopSignal;
use mrol_map::voxel::{LatticeFromPoints, VoxelKey};
use mrol_store::{FolderUse, MapFolder, Snapshot, StoreError, StoreSettings};

/// Which maps to write snapshots of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Saving {
    /// Maps that changed since their last snapshot.
    Changed,
    /// Maps that changed, with much journal or an old snapshot.
    Due,
}

/// A named map and who waits for it.
#[derive(Debug)]
pub(super) struct HostedMap {
    pub(super) name: MapName,
    pub(super) uuid: Uuid,
    pub(super) map: Arc<MultiResolutionMap>,
    /// What keeps it across restarts, where anything does.
    pub(super) folder: Option<Arc<MapFolder>>,
    pub(super) commit_queue: CommitQueue,
    /// The last revision that was published.
    announced: watch::Receiver<u64>,
    /// The last changes, for who watches the map.
    pub(super) recent: Arc<RecentChanges>,
    /// What became of the last scans that robots sent.
    pub(super) events: EventLog,
    /// Whole states that watchers are being told of.
    pub(super) full_states: FullStates,
    /// One robot's scans are taken in order.
    turns: Mutex<HashMap<RobotName, Arc<tokio::sync::Mutex<()>>>>,
    /// What makes checks of bodies fast, once somebody asked for one.
    pub(super) planner: OnceLock<Planner>,
    /// Where and when robots were last seen.
    pub(super) sightings: Sightings,
    /// Robots whose scans are refused, and that want to be looked for.
    pub(super) lost: LostRobots,
    /// One undo is found out and made before the next is looked at.
    pub(super) undo_turn: Arc<tokio::sync::Mutex<()>>,
    /// A snapshot is due, and there is no room for it.
    is_put_off: AtomicBool,
    /// Held while keep-outs are ended whose time is up.
    pub(super) expiring: tokio::sync::Mutex<()>,
    /// They cannot be ended, which was said.
    pub(super) is_expiry_put_off: AtomicBool,
}

/// Sides of keep-outs that points are compared with where they arrive, less than a millisecond; see
/// [`INLINE_POINTS`](super::pool::INLINE_POINTS).
const INLINE_SIDES: usize = 1 << 17;
/// Robots whose turns are remembered before those that nobody waits for are dropped.
const TURNS_KEPT: usize = 1024;
/// Seed of the sample on which false positives are measured: the same map gives the same figures.
const RATE_SEED: u64 = 1;

impl HostedMap {
    /// Takes a map into service; `thread` makes its changes.
    pub(super) fn new(
        thread: CommitThread,
        name: MapName,
        uuid: Uuid,
        map: impl Into<Arc<MultiResolutionMap>>,
        folder: Option<MapFolder>,
        settings: &StoreSettings,
    ) -> Self {
        Self::of_shared(thread, name, uuid, map.into(), folder.map(Arc::new), settings)
    }

    /// This map under the name `name`, once it has ended under its own.
    pub(super) fn again_as(&self, thread: CommitThread, name: MapName, settings: &StoreSettings) -> Self {
        Self::of_shared(thread, name, self.uuid, Arc::clone(&self.map), self.folder.clone(), settings)
    }

    fn of_shared(
        thread: CommitThread,
        name: MapName,
        uuid: Uuid,
        map: Arc<MultiResolutionMap>,
        folder: Option<Arc<MapFolder>>,
        settings: &StoreSettings,
    ) -> Self {
        let (announcing, announced) = watch::channel(map.revision());
        let recent = Arc::new(RecentChanges::new(map.revision(), settings.watch_bytes_max));
        let told = Told { announced: announcing, recent: Arc::clone(&recent) };
        let commit_queue =
            CommitQueue::begin(thread, name.clone(), Arc::clone(&map), folder.clone(), told, settings);
        Self {
            name,
            uuid,
            map,
            folder,
            commit_queue,
            announced,
            recent,
            events: EventLog::default(),
            full_states: FullStates::default(),
            turns: Mutex::new(Rank::Brief, HashMap::new()),
            planner: OnceLock::new(),
            sightings: Sightings::default(),
            lost: LostRobots::default(),
            undo_turn: Arc::default(),
            is_put_off: AtomicBool::default(),
            expiring: tokio::sync::Mutex::default(),
            is_expiry_put_off: AtomicBool::default(),
        }
    }

    /// Writes a snapshot where there is need and room for one; true when it did. A map whose journal failed is left as
    /// it is.
    pub(super) fn save(&self, which: Saving, budget: &ResourceBudget) -> Result<bool, StoreError> {
        let Some(folder) = self.folder.as_ref().filter(|_| self.commit_queue.stopped().is_none()) else {
            return Ok(false);
        };
        let changed = self.map.revision() != folder.used().snapshot;
        if !changed || which == Saving::Due && !folder.snapshot_is_due() {
            return Ok(false);
        }
        let lent = budget
            .check_to_shrink()
            .and_then(|()| budget.reserve_transient(self.snapshot_bytes(), "a snapshot"));
        let Ok(_lent) = lent.inspect_err(|no_room| self.put_off(&no_room.message)) else {
            return Ok(false);
        };
        let (start, snapshot) = (Instant::now(), Snapshot::of(&self.map, self.uuid));
        let saved = folder.save(&snapshot, budget.file_bytes_max());
        // Its folder may go while it is written.
        if matches!(saved, Err(StoreError::Gone)) {
            return Ok(false);
        }
        if let Err(no_room @ StoreError::NoRoom { .. }) = &saved {
            self.put_off(&no_room.to_string());
            return Ok(false);
        }
        saved?;
        thin(&self.map, folder);
        self.is_put_off.store(false, Ordering::Relaxed);
        tracing::info!(map = %self.name, revision = snapshot.contents.revision, elapsed = ?start.elapsed(), "saved");
        Ok(true)
    }

    /// Gives up what is kept for undo alone, where the disk is so full that changes will be refused next.
    pub(super) fn make_room(&self, budget: &ResourceBudget) -> Result<(), StoreError> {
        let Some(folder) = self.folder.as_ref().filter(|_| budget.is_disk_scarce()) else { return Ok(()) };
        match folder.give_up_undo() {
            Ok(true) => {
                tracing::warn!(map = %self.name, "the disk is nearly full: what was kept for undo is given up")
            }
            Ok(false) | Err(StoreError::Gone) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// There is no room for a snapshot: said once, tried again and again. Nothing is lost, since the journal is kept until
    /// there is one.
    fn put_off(&self, why: &str) {
        if !self.is_put_off.swap(true, Ordering::Relaxed) {
            tracing::warn!(map = %self.name, why, "a snapshot is put off: the journal grows instead");
        }
    }

    /// Bytes of memory that a snapshot takes while it is made.
    pub(super) fn snapshot_bytes(&self) -> u64 {
        snapshot_bytes(&self.map)
    }

    /// Refuses changes that would be refused in the end, before any work is done for them.
    pub(super) fn check_writable(&self) -> Result<(), ServiceError> {
        self.commit_queue.stopped().map_or(Ok(()), |stop| Err(stop.refusal(&self.name)))
    }

    /// Why there is nothing more to tell of this map.
    pub(super) fn ended(&self) -> ServiceError {
        let gone = || ServiceError::new(Reason::MapNotFound, format!("map {} is gone", self.name));
        self.commit_queue.stopped().map_or_else(gone, |stop| stop.refusal(&self.name))
    }

    pub(super) fn version(&self, ContentVersion { revision, hash }: ContentVersion) -> MapVersion {
        MapVersion { revision, map_uuid: self.uuid, content_hash: Some(hash) }
    }

    /// The map as it is.
    pub(super) fn version_now(&self) -> MapVersion {
        self.version(self.map.content_version())
    }

    /// The map as it was at a revision, of which a change told before.
    pub(super) fn version_at(&self, revision: u64) -> MapVersion {
        let now = self.version_now();
        let content_hash = now.content_hash.filter(|_| now.revision == revision);
        MapVersion { revision, content_hash, ..now }
    }

    /// Waits until the robot's earlier scans are done.
    pub(super) async fn lock_robot(&self, robot: &RobotName) -> OwnedMutexGuard<()> {
        let turn = {
            let mut turns = self.turns.lock();
            if turns.len() >= TURNS_KEPT {
                turns.retain(|_, turn| Arc::strong_count(turn) > 1);
            }
            Arc::clone(turns.entry(robot.clone()).or_default())
        };
        turn.lock_owned().await
    }

    /// Waits until `revision` is there. Who waits hears of the map's end at once.
    pub(super) async fn wait_for_revision(
        &self,
        revision: u64,
        wait_max: Duration,
    ) -> Result<(), ServiceError> {
        let mut announced = self.announced.clone();
        let reached = async {
            tokio::select! {
                biased;
                reached = async { announced.wait_for(|announced| *announced >= revision).await.is_ok() } => reached,
                () = self.commit_queue.ended() => false,
            }
        };
        if let Ok(true) = tokio::time::timeout(wait_max, reached).await {
            return Ok(());
        }
        if let Some(stop @ (Stop::Deleted | Stop::Replaced)) = self.commit_queue.stopped() {
            return Err(stop.refusal(&self.name));
        }
        let message = format!(
            "min_revision {revision} was not reached within {wait_max:?}: map {} is at {}",
            self.name,
            self.map.revision()
        );
        Err(ServiceError::new(Reason::RevisionNotReached, message))
    }

    pub(super) fn check_level(&self, level: u32) -> Result<(), ServiceError> {
        let levels = self.map.settings().levels;
        if level < levels {
            return Ok(());
        }
        let message = format!("level must lie in 0..={} of map {}, got {level}", levels - 1, self.name);
        Err(ServiceError::new(Reason::LevelOutOfRange, message))
    }

    pub(super) fn check_uuid(&self, uuid: Option<Uuid>) -> Result<(), ServiceError> {
        if uuid.is_none_or(|uuid| uuid == self.uuid) {
            return Ok(());
        }
        let message =
            format!("map_uuid of map {} is {}: it was deleted and made again", self.name, self.uuid);
        Err(ServiceError::new(Reason::MapReplaced, message))
    }

    /// Answers a query. One of many points keeps changes from beginning meanwhile, so that no shorter one queues behind
    /// a change that waits for it.
    pub(super) fn query(
        &self,
        query: &PointQuery,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<PointAnswer, ServiceError> {
        let points = query.points.as_slice();
        let long_read = (points.len() > POINTS_PER_STEP).then(|| self.map.long_read());
        let view = self.map.view_of(points, &query.map_from_points.unwrap_or_else(Pose::identity));
        let view = if query.keep_out { view.with_keep_outs() } else { view };
        limits
            .check_keep_out_tests(points.len(), view.keep_outs().map_or(0, |keep_outs| keep_outs.sides()))?;
        self.query_in(view, long_read, query, stop)
    }

    /// Answers a query where it need not wait for a lock, and its points are not compared with many keep-outs.
    pub(super) fn try_query(&self, query: &PointQuery) -> Option<Result<PointAnswer, ServiceError>> {
        let map_from_points = query.map_from_points.unwrap_or_else(Pose::identity);
        let points = query.points.as_slice();
        let mut view = self.map.try_view_of(points, &map_from_points)?;
        if query.keep_out {
            view = view.try_with_keep_outs()?;
            let sides = view.keep_outs().map_or(0, |keep_outs| keep_outs.sides());
            if points.len() * sides > INLINE_SIDES {
                return None;
            }
        }
        Some(self.query_in(view, None, query, StopSignal::NEVER))
    }

    fn query_in(
        &self,
        view: MapView<'_>,
        long_read: Option<LongRead<'_>>,
        query: &PointQuery,
        stop: StopSignal<'_>,
    ) -> Result<PointAnswer, ServiceError> {
        query.answer_in(view, long_read, self.uuid, self.map.lattice(), stop)
    }

    /// Names the first point that falls in no voxel.
    pub(super) fn point_without_voxel(&self, points: &[Point], quantize: &LatticeFromPoints) -> ServiceError {
        point_without_voxel(points, quantize, self.map.lattice())
    }

    /// The voxels that are asked for, at most `most` of them.
    pub(super) fn list(
        &self,
        request: &ListingRequest,
        most: usize,
        stop: StopSignal<'_>,
    ) -> Result<VoxelListing, ServiceError> {
        let ListingRequest { level, selection, keep_out, .. } = *request;
        let long_read = self.map.long_read();
        let view = long_read.view();
        let view = if keep_out { view.with_keep_outs() } else { view };
        // How many there are of a whole level is known: nothing is copied of more than may be listed.
        let whole = if selection.is_everything() { view.count_voxels(level, &selection, stop) } else { 0 };
        if whole > most {
            return Err(listing_too_large(level, whole, most));
        }
        let (copy, version) = (view.level_voxels(level, &selection, most, stop), view.version());
        let keep_outs = view.keep_outs().cloned().unwrap_or_default();
        drop(view);
        drop(long_read);
        if copy.len() > most {
            return Err(listing_too_large(level, copy.len(), most));
        }
        let kept_out = keep_outs.voxels_of(level, &selection, self.map.lattice(), most, stop);
        check_not_stopped(stop)?;
        let kept_out = kept_out.map_err(|_| keep_outs_too_large(level, most))?;
        let mut keys = Vec::with_capacity((copy.len() + kept_out.len()).min(most));
        let is_other = |key: &VoxelKey| kept_out.is_empty() || !kept_out.contains(*key);
        copy.for_some(stop, |some| keys.extend(some.iter().copied().filter(is_other)));
        check_not_stopped(stop)?;
        let found = keys.len() + kept_out.len();
        if found > most {
            return Err(listing_too_large(level, found, most));
        }
        keys.extend(kept_out.iter());
        let (resolution_m, voxels_total) = (self.map.lattice().resolution_m(level), keys.len());
        Ok(VoxelListing { resolution_m, voxels_total, keys, version: self.version(version) })
    }

    /// The number of voxels that are asked for. Those of keep-outs are found out as for a listing, which gives its locks back
    /// before it looks at shapes: at most `most` are counted then.
    pub(super) fn count(
        &self,
        request: &ListingRequest,
        most: usize,
        stop: StopSignal<'_>,
    ) -> Result<VoxelListing, ServiceError> {
        let ListingRequest { level, selection, keep_out, .. } = *request;
        if keep_out {
            let listing = self.list(request, most, stop)?;
            return Ok(VoxelListing { keys: Vec::new(), ..listing });
        }
        let long_read = self.map.long_read();
        let view = long_read.view();
        let (voxels_total, version) = (view.count_voxels(level, &selection, stop), view.version());
        check_not_stopped(stop)?;
        let resolution_m = self.map.lattice().resolution_m(level);
        Ok(VoxelListing { resolution_m, voxels_total, keys: Vec::new(), version: self.version(version) })
    }

    pub(super) fn describe(
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
            scans: trajectory.len(),
            robots: trajectory.robots(),
            sightings: Vec::new(),
            set_bytes: described.set_bytes,
            moment_bytes: described.moment_bytes,
            commits: self.commit_queue.durations(),
            trajectory_bytes: described.trajectory_bytes,
            viewpoints: described.viewpoints,
            viewpoint_bytes: described.viewpoint_bytes,
            storage,
        })
    }

    /// Why the map takes no changes.
    pub(super) fn failure(&self) -> Option<&str> {
        match self.commit_queue.stopped()? {
            Stop::Failed(reason) => Some(reason),
            Stop::Deleted | Stop::Replaced => None,
        }
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

fn listing_too_large(level: u32, found: usize, most: usize) -> ServiceError {
    let message = format!(
        "level {level} has {found} voxels there or more, listed_voxels_max is {most}: ask for a region or a coarser level"
    );
    ServiceError::new(Reason::ListingTooLarge, message)
}

fn keep_outs_too_large(level: u32, most: usize) -> ServiceError {
    let message = format!(
        "the keep-outs take more of level {level} there than listed_voxels_max, which is {most}, allows to look through: ask \
         for a region, a coarser level, or without keep_out"
    );
    ServiceError::new(Reason::ListingTooLarge, message)
}

/// Bytes of memory that a snapshot of `map` takes while it is made: 55 to 70 % of the map's were measured.
pub(super) fn snapshot_bytes(map: &MultiResolutionMap) -> u64 {
    map.memory_bytes() as u64 / 4 * 3
}

/// Thins the poses of `map` that undo reaches no more. Waits for the turn to change the map.
pub(super) fn thin(map: &MultiResolutionMap, folder: &MapFolder) {
    let before = folder.used().kept_from;
    map.committer().thin(before, &folder.settings().trajectory_spacing);
}
