//! The operations of the server, once for every protocol: domain types in, domain types out.
//!
//! Limits are checked here and before any work is done; every failure is a [`ServiceError`].

mod allowed_maps;
mod allowed_scans;
mod asker;
mod block;
mod catalog;
mod commit_queue;
mod deletion;
mod digest;
mod error;
mod error_code;
mod event_log;
mod events;
mod filtered_scan;
mod full_state;
mod gauges;
mod growth;
mod hosted_map;
mod keep_out;
mod keep_out_expiry;
mod limits;
mod localization;
#[cfg(test)]
mod looks;
mod map_file;
mod mapping;
mod maps;
#[cfg(all(test, feature = "shuttle"))]
mod modeled;
mod observer;
mod observers;
mod outbox;
mod point_query;
mod pool;
mod pools;
mod question;
mod reason;
mod recent_changes;
mod recovery;
mod request;
mod resource_budget;
mod scans;
mod settings;
mod shortage;
#[cfg(feature = "testing")]
mod testing;
mod thread_queue;
mod time_limit;
mod trajectory;
mod undo;
mod unseen;
mod watch;
mod watermarks;

pub use allowed_maps::AllowedMaps;
pub use allowed_scans::AllowedScans;
pub use asker::Asker;
pub use error::ServiceError;
pub use error_code::ErrorCode;
pub use event_log::EVENTS_MAX;
pub use events::EventWatch;
pub use gauges::{Gauges, MemoryReading, Readings};
pub use limits::{Limits, Marks};
pub use localization::{
    CANDIDATES_DEFAULT, CandidateAnswer, LocalizationAnswer, LocalizationRequest, SEARCH_SHARE,
    TIME_LIMIT_DEFAULT,
};
pub use observer::{Change, End, Ended, JudgedScan, Observer, Outcome};
pub use pool::PoolUse;
pub use question::{
    Answered, Asked, CheckAs, ClassifyQuestion, Collisions, FRONTIERS_MAX_DEFAULT, FrontierQuestion,
    GridQuestion, GridScope, KnownPart, MotionCheck, NearestQuestion, PoseCheck, Question, QuestionedMap,
    RayQuestion, RaysToward, SphereCheck,
};
pub use reason::{Reason, ToldBy};
pub use request::{
    BlockAnswer, BlockBytes, BlockForm, BlockRequest, BlockVoxels, Cause, ChangePart, DeleteKeepOut,
    Deletion, DeletionAnswer, DeletionTarget, EventMessage, EventsQuery, FailedScan, Foreground,
    KeepOutAnswer, KeepOutList, LeftViewpoint, ListingRequest, MapFile, MapInfo, MapList, MapStorage,
    MapVersion, NotSeenSince, ObservedVoxel, ObserversAnswer, ObserversRequest, ObservingScan, PointAnswer,
    PointCloud, PointQuery, PointTimes, PutKeepOut, ScanAnswer, ScanEvent, ScanRequest, StatePart,
    TimeReference, TrajectoryAnswer, TrajectoryQuery, UnavailableMap, Undo, UndoAnswer, UndoTarget,
    VoxelListing, WatchEvent, WatchForm, WatchMessage, WatchRequest, WatchedScan, WatchedSince,
    WatchedViewpoint,
};
pub use settings::{EVERY_ROBOT, RobotSettings, ServiceSettings};
pub use shortage::Shortage;
pub use trajectory::TrajectoryPieces;
pub use watch::Watch;

use std::sync::Arc;
use std::time::Duration;

use catalog::Catalog;
use commit_queue::{Refusal, Step};
use hosted_map::HostedMap;
use mrol_map::map::{CallerName, MapName};
use mrol_map::util::StopSignal;
use mrol_store::OpeningProgress;
use pool::{FreeThread, Pool};
use pools::Pools;
use resource_budget::ResourceBudget;
use time_limit::{TimeLimit, check_not_stopped, ended_early};

/// All operations, on all maps or on those that a caller may name. A clone is another handle on the same maps.
///
/// Each operation fails with `PermissionDenied` where the handle may not name the map.
#[derive(Debug, Clone)]
pub struct MapService {
    inner: Arc<Inner>,
    allowed_maps: AllowedMaps,
    scans: AllowedScans,
    /// Whose requests a map remembers under this name.
    caller: Option<CallerName>,
    /// Whom its work counts for, where callers take turns.
    asker: Asker,
}

#[derive(Debug)]
struct Inner {
    settings: ServiceSettings,
    catalog: Catalog,
    pools: Pools,
    budget: Arc<ResourceBudget>,
}

impl MapService {
    /// Opens the service with the maps of its data folder; `progress` tells how far that has come. Reads files: not
    /// for an async thread.
    ///
    /// # Errors
    /// When a setting is out of range, or a map on disk cannot be read: the error names the file.
    pub fn open(settings: ServiceSettings, progress: &OpeningProgress) -> Result<Self, ServiceError> {
        settings.alignment.checked().map_err(|e| ServiceError::new(Reason::BadSettings, e.to_string()))?;
        settings.filter.checked()?;
        let inner = Inner {
            catalog: Catalog::open(settings.data_dir.as_deref(), &settings.store, progress)?,
            pools: Pools::start(&settings)?,
            budget: ResourceBudget::new(settings.gauges.clone(), settings.limits.marks()).into(),
            settings,
        };
        Ok(Self {
            inner: Arc::new(inner),
            allowed_maps: AllowedMaps::Every,
            scans: AllowedScans::default(),
            caller: None,
            asker: Asker::default(),
        })
    }

    /// The same maps for a caller of a name, who may name no others than those of `allowed_maps`, and send and undo no others than
    /// the scans of `scans`.
    pub fn limited_to(
        &self,
        caller: Option<CallerName>,
        allowed_maps: AllowedMaps,
        scans: AllowedScans,
    ) -> Self {
        let asker = self.asker.clone();
        Self { inner: Arc::clone(&self.inner), allowed_maps, scans, caller, asker }
    }

    /// The same, where work counts for `asker`: callers take turns at the threads for questions.
    #[must_use]
    pub fn asked_by(self, asker: Asker) -> Self {
        Self { asker, ..self }
    }

    /// The bounds on what callers may ask.
    pub fn limits(&self) -> &Limits {
        &self.inner.settings.limits
    }

    /// The filter of maps whose makers do not say.
    pub fn default_filter(&self) -> mrol_map::bloom::FilterSettings {
        self.inner.settings.filter
    }

    /// Looks how full disk and memory are; to be called every second or so. May block: not for an async thread.
    pub fn measure(&self) -> Readings {
        self.inner.catalog.all().iter().for_each(|map| map.lost.forget_old());
        self.inner.budget.look()
    }

    /// What there is too little of, and changes are refused for.
    pub fn shortages(&self) -> Vec<Shortage> {
        self.inner.budget.shortages()
    }

    /// What the threads for work that uses the CPU are doing.
    pub fn pools(&self) -> [PoolUse; 12] {
        self.inner.pools.in_use()
    }

    /// Says of each point whether its voxel is occupied, all at one revision.
    ///
    /// # Errors
    /// `InvalidArgument` for a point in no voxel (named by its place), a level that is none, too many points;
    /// `NotFound`; `DeadlineExceeded` when `min_revision` does not come; `FailedPrecondition` when the map has
    /// another uuid.
    pub async fn query_points(&self, map: &MapName, query: PointQuery) -> Result<PointAnswer, ServiceError> {
        let lookup = query.lookup;
        let work = async {
            let map = self.map(map)?;
            self.limits().check_points(query.points.len())?;
            map.check_level(query.level)?;
            map.check_uuid(query.map_uuid)?;
            if let Some(revision) = query.min_revision {
                map.wait_for_revision(
                    revision,
                    Duration::from_secs_f64(self.limits().min_revision_wait_max_s),
                )
                .await?;
            }
            if query.points.len() <= pool::INLINE_POINTS
                && let Some(answer) = map.try_query(&query)
            {
                return answer;
            }
            let inner = Arc::clone(&self.inner);
            let answer = move |stop: StopSignal<'_>| map.query(&query, &inner.settings.limits, stop);
            self.inner.pools.queries.run(answer).await?
        };
        self.observed("QueryPoints", Some(map), work, |answer| Outcome::Points {
            lookup,
            points: answer.points,
        })
        .await
    }

    /// Says where in the map a scan was taken, with no guess. The search stops as soon as nobody awaits its answer.
    ///
    /// # Errors
    /// `InvalidArgument` for a scan without a usable point or with too many, a search box away from the map, a time
    /// limit or number of candidates beyond the limits; `FailedPrecondition` where the map is empty;
    /// `ResourceExhausted` where the map takes more than `localization_grid_bytes_max`, or there is no memory for the
    /// search; `NotFound`.
    pub async fn localize(
        &self,
        map: &MapName,
        request: LocalizationRequest,
    ) -> Result<LocalizationAnswer, ServiceError> {
        let work = async {
            let map = self.map(map)?;
            let request = request.within(self.limits())?;
            let inner = Arc::clone(&self.inner);
            let search =
                move |stop: StopSignal<'_>| map.localize(&request, &inner.settings, &inner.budget, stop);
            self.inner.pools.localization.run(search).await?
        };
        self.observed("Localize", Some(map), work, |_| Outcome::Read).await
    }

    /// Takes voxels out, with all their descendants.
    ///
    /// # Errors
    /// `InvalidArgument` for a point in no voxel, a key out of the level's range, a level that is none, too many
    /// of them; `NotFound`; `ResourceExhausted` while the disk is nearly full.
    pub async fn delete_voxels(
        &self,
        map: &MapName,
        deletion: Deletion,
    ) -> Result<DeletionAnswer, ServiceError> {
        let work = async {
            let map = self.map(map)?;
            map.check_level(deletion.level)?;
            match &deletion.target {
                DeletionTarget::Points(points) => self.limits().check_points(points.len())?,
                DeletionTarget::Keys(keys) => self.limits().check_keys(keys.len())?,
                DeletionTarget::Region(_) | DeletionTarget::NotSeenSince(_) => {}
            }
            // Who touched what since is read from the journal, as for an undo.
            let reads_journal = matches!(deletion.target, DeletionTarget::NotSeenSince(_));
            let pool = if reads_journal { &self.inner.pools.undo } else { &self.inner.pools.mapping };
            let limit = TimeLimit::new("undo_time_max", self.limits().undo_time_max_s);
            let (inner, deletion, caller) =
                (Arc::clone(&self.inner), Arc::new(deletion), self.caller.clone());
            let submit = move |stop: StopSignal<'_>| {
                let submit = |stop: StopSignal<'_>| {
                    map.submit_deletion(&deletion, caller.as_ref(), &inner.budget, stop)
                };
                if reads_journal { limit.run(stop, submit) } else { submit(stop) }
            };
            self.submit_and_wait(pool, None, submit).await
        };
        self.observed("DeleteVoxels", Some(map), work, |answer| Outcome::Changed(Change::of_deletion(answer)))
            .await
    }

    /// Takes scans or a deletion back: the map is then what all other changes make of it, with the deletions as they were. Of
    /// the voxels that a scan touched, those that no other scan holds go; those that a deletion took out come back.
    ///
    /// # Errors
    /// `NotFound` without such a map, scan or revision; `FailedPrecondition` for a change from before what undo reaches, for
    /// a revision that an undo made, or where maps are kept in memory only; `ResourceExhausted` while the disk is nearly
    /// full, where there is no memory to find out in what the map would be, or none for what comes back; `DeadlineExceeded`
    /// with `time_limit` beyond `undo_time_max`.
    pub async fn undo(&self, map: &MapName, undo: Undo) -> Result<UndoAnswer, ServiceError> {
        let work = async {
            self.scans.permit_undo(&undo.target)?;
            let (map, undo) = (self.map(map)?, Arc::new(undo));
            let (inner, caller) = (Arc::clone(&self.inner), self.caller.clone());
            let limit = TimeLimit::new("undo_time_max", self.limits().undo_time_max_s);
            // Until its outcome is known: what was withdrawn before it is then what it found.
            let pool = &self.inner.pools.undo;
            let _turn = pool.in_turn(map.turn_of_undo()).await?;
            // A thread first: the robot's scans wait for this undo, and not for those of other maps.
            let thread = pool.thread().await?;
            let _robot = map.turn_of_target(&undo.target).await;
            self.submit_and_wait(pool, Some(thread), move |stop| {
                limit.run(stop, |stop| map.submit_undo(&undo, caller.as_ref(), &inner.budget, &limit, stop))
            })
            .await
        };
        self.observed("Undo", Some(map), work, |answer| Outcome::Changed(Change::of_undo(answer))).await
    }

    /// The occupied voxels of a level that are asked for, or their number, all at one revision.
    ///
    /// # Errors
    /// `InvalidArgument` for a level that is none; `ResourceExhausted` when more than `listed_voxels_max` are to be listed;
    /// `NotFound`.
    pub async fn list_voxels(
        &self,
        map: &MapName,
        request: ListingRequest,
    ) -> Result<VoxelListing, ServiceError> {
        let work = async {
            let map = self.map(map)?;
            map.check_level(request.level)?;
            let most = self.limits().listed_voxels_max;
            let list = move |stop: StopSignal<'_>| match request.count_only {
                true => map.count(&request, most, stop),
                false => map.list(&request, most, stop),
            };
            self.inner.pools.queries.run(list).await?
        };
        self.observed("ListVoxels", Some(map), work, |_| Outcome::Read).await
    }

    /// Prepares a change on a thread of `pool`, or on `first` where there is one, and waits until it is made. Prepares it
    /// again where the map has moved on meanwhile. A caller who goes away before the change is submitted cancels it.
    async fn submit_and_wait<A: Send + 'static>(
        &self,
        pool: &Pool,
        mut first: Option<FreeThread>,
        submit: impl Fn(StopSignal<'_>) -> Result<Step<A>, ServiceError> + Clone + Send + 'static,
    ) -> Result<A, ServiceError> {
        loop {
            let thread = match first.take() {
                Some(thread) => thread,
                None => pool.thread().await?,
            };
            match pool.run_on(thread, submit.clone()).await?? {
                Step::Answered(answer) => return Ok(answer),
                Step::Submitted(outcome, answer) => match outcome.await.map_err(commit_thread_ended)? {
                    Ok(committed) => return Ok(answer(committed)),
                    Err(Refusal::Failed(error)) => return Err(error),
                    Err(Refusal::Stale) => {}
                },
            }
        }
    }

    fn map(&self, name: &MapName) -> Result<Arc<HostedMap>, ServiceError> {
        self.inner.catalog.get(&self.allowed_maps.check(name)?)
    }
}

/// The map's thread is gone, by a defect.
fn commit_thread_ended(_: tokio::sync::oneshot::error::RecvError) -> ServiceError {
    ServiceError::new(Reason::JobPanicked, "the change failed by a defect of the server")
}
