//! A handle on the service: its maps, and the caller on whose behalf they are named. Its operations are
//! `impl MapService` blocks in the rooms of their kind.

use std::sync::Arc;

use super::caller::{AllowedMaps, AllowedScans};
use super::commit::{Refusal, Step};
use super::error::{Reason, ServiceError};
use super::limits::Limits;
use super::maps::{Catalog, HostedMap};
use super::observer::{Change, End, Ended, Outcome};
use super::resources::{Readings, ResourceBudget, Shortage};
use super::settings::ServiceSettings;
use super::work::{Asker, FreeThread, Lane, LaneUse, Lanes, Requester};
use mrol_map::map::{CallerName, Committed, MapName};
use mrol_map::util::StopSignal;
use mrol_store::OpeningProgress;
use tokio::sync::oneshot;
use tracing::Instrument;

/// All operations, on all maps or on those that a caller may name. A clone is another handle on the same maps.
///
/// Each operation fails with `PermissionDenied` where the handle may not name the map.
#[derive(Debug, Clone)]
pub struct MapService {
    pub(super) inner: Arc<Inner>,
    pub(super) allowed_maps: AllowedMaps,
    pub(super) scans: AllowedScans,
    /// Whose requests a map remembers under this name.
    pub(super) caller: Option<CallerName>,
    /// Whom its work counts for, where callers take turns.
    pub(super) asker: Asker,
    /// True of what another node asks for a caller of its own: it is taken no further.
    pub(super) is_forwarded: bool,
}

#[derive(Debug)]
pub(super) struct Inner {
    pub(super) settings: ServiceSettings,
    pub(super) catalog: Arc<Catalog>,
    pub(super) lanes: Lanes,
    pub(super) budget: Arc<ResourceBudget>,
}

impl MapService {
    /// Opens the service with the maps of its data folder; `progress` tells how far that has come. Reads files: not
    /// for an async thread.
    ///
    /// # Errors
    /// When a setting is out of range, or a map on disk cannot be read: the error names the file.
    pub fn open(settings: ServiceSettings, progress: &OpeningProgress) -> Result<Self, ServiceError> {
        let service = Self::begin(settings, progress)?;
        service.open_maps()?;
        Ok(service)
    }

    /// Opens the service before its maps are: [`MapService::open_maps`] opens them, and a request for one meanwhile
    /// waits until it is open. Reads files: not for an async thread.
    ///
    /// # Errors
    /// When a setting is out of range, or the data folder cannot be read.
    pub fn begin(settings: ServiceSettings, progress: &OpeningProgress) -> Result<Self, ServiceError> {
        settings.alignment.checked().map_err(|e| ServiceError::new(Reason::BadSettings, e.to_string()))?;
        settings.filter.checked()?;
        let inner = Inner {
            catalog: Catalog::find_maps(&settings, progress)?.into(),
            lanes: Lanes::start(&settings)?,
            budget: ResourceBudget::new(settings.gauges.clone(), settings.limits.marks()).into(),
            settings,
        };
        Ok(Self {
            inner: Arc::new(inner),
            allowed_maps: AllowedMaps::Every,
            scans: AllowedScans::default(),
            caller: None,
            asker: Asker::default(),
            is_forwarded: false,
        })
    }

    /// The same maps for a caller of a name, who may name no others than those of `allowed_maps`, and send and undo no
    /// others than the scans of `scans`.
    pub fn limited_to(
        &self,
        caller: Option<CallerName>,
        allowed_maps: AllowedMaps,
        scans: AllowedScans,
    ) -> Self {
        Self { allowed_maps, scans, caller, ..self.clone() }
    }

    /// The same for what another node of the cluster asks for a caller of its own: it is taken no further.
    #[must_use]
    pub fn forwarded(self) -> Self {
        Self { is_forwarded: true, ..self }
    }

    /// The same, where work counts for `asker`: callers take turns at the threads for all that uses the CPU.
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
        self.inner.catalog.relieve_commits();
        self.inner.catalog.all().iter().for_each(|map| map.robots.lost.forget_old());
        self.inner.budget.look()
    }

    /// What there is too little of, and changes are refused for.
    pub fn shortages(&self) -> Vec<Shortage> {
        self.inner.budget.shortages()
    }

    /// What the threads for work that uses the CPU are doing.
    pub fn lanes(&self) -> [LaneUse; 14] {
        self.inner.lanes.in_use()
    }

    /// Reads a large request, or writes a large answer or a part of one, away from the threads of the async runtime: in
    /// the caller's turn.
    ///
    /// # Errors
    /// `Internal` when `make` panicked.
    pub async fn convert<T: Send + 'static>(
        &self,
        make: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ServiceError> {
        self.inner.lanes.messages.run(&self.asker, move |_| make()).await
    }

    /// Does `work`, and tells the observers how the operation ended, with what `outcome` makes of the answer. They are
    /// told where the caller goes away as well.
    pub(super) async fn observed<A>(
        &self,
        operation: &'static str,
        map: Option<&MapName>,
        work: impl Future<Output = Result<A, ServiceError>>,
        outcome: impl FnOnce(&A) -> Outcome,
    ) -> Result<A, ServiceError> {
        let pending = Pending { service: self, operation, map };
        let answer = work.await;
        std::mem::forget(pending);
        let end = match &answer {
            Ok(answer) => End::Done(outcome(answer)),
            Err(error) => End::Failed(error),
        };
        self.tell(&Ended { operation, caller: self.caller.as_ref(), map, end });
        answer
    }

    fn tell(&self, ended: &Ended<'_>) {
        self.inner.settings.observers.iter().for_each(|observer| observer.operation_ended(ended));
    }

    /// Prepares a change on a thread of `lane` in the requester's turn, or on `first` where there is one, and waits
    /// until it is made. Prepares it again where the map has moved on meanwhile. A caller who goes away before the
    /// change is submitted cancels it; of one who goes away later the observers are told what the operation removed
    /// from the map all the same.
    pub(super) async fn submit_and_wait<A: Send + 'static>(
        &self,
        (operation, map): (&'static str, &Arc<HostedMap>),
        (lane, requester): (&Lane, &Requester),
        mut first: Option<FreeThread>,
        submit: impl Fn(StopSignal<'_>) -> Result<Step<A>, ServiceError> + Clone + Send + 'static,
    ) -> Result<A, ServiceError> {
        loop {
            let thread = match first.take() {
                Some(thread) => thread,
                None => lane.thread(requester).await?,
            };
            let step = lane.run_on(thread, submit.clone()).await??;
            match step {
                Step::Answered(answer) => return Ok(answer),
                Step::Ready(submission, answer) => {
                    let outcome = map.commit_queue.submit(requester, submission)?;
                    match self.outcome_of(operation, map, outcome).await? {
                        Ok(committed) => return Ok(answer(committed)),
                        Err(Refusal::Failed(error)) => return Err(error),
                        Err(Refusal::Stale) => {}
                    }
                }
            }
        }
    }

    async fn outcome_of(
        &self,
        operation: &'static str,
        map: &Arc<HostedMap>,
        outcome: oneshot::Receiver<Result<Committed, Refusal>>,
    ) -> Result<Result<Committed, Refusal>, ServiceError> {
        let mut submitted = Submitted { service: self, operation, map, outcome };
        (&mut submitted.outcome).await.map_err(commit_thread_ended)
    }

    /// The map of that name, which is opened where it sleeps. Where another node has just made it, waits for the copy
    /// of this one; where other nodes hold it, names those.
    pub(super) async fn map(&self, name: &MapName) -> Result<Arc<HostedMap>, ServiceError> {
        let here = self.map_here(name).await;
        match (&here, &self.inner.settings.cluster) {
            (Err(error), Some(cluster)) if error.reason == Reason::MapNotFound => {
                if !cluster.catalog.look_for(name).await? {
                    return here;
                }
                self.map_here(name).await
            }
            _ => here,
        }
    }

    /// The map of that name of which this server has a copy by now.
    pub(super) async fn map_here(&self, name: &MapName) -> Result<Arc<HostedMap>, ServiceError> {
        self.inner.catalog.get(&self.allowed_maps.check(name)?, &self.asker).await
    }
}

/// An operation that is not over: dropped, its caller has gone.
struct Pending<'a> {
    service: &'a MapService,
    operation: &'static str,
    map: Option<&'a MapName>,
}

impl Drop for Pending<'_> {
    fn drop(&mut self) {
        let Self { service, operation, map } = *self;
        let caller = service.caller.as_ref();
        service.tell(&Ended { operation, caller, map, end: End::CallerGone });
    }
}

/// A change on its way into a map: dropped before its outcome is heard, its caller has gone.
struct Submitted<'a> {
    service: &'a MapService,
    operation: &'static str,
    map: &'a Arc<HostedMap>,
    outcome: oneshot::Receiver<Result<Committed, Refusal>>,
}

impl Drop for Submitted<'_> {
    fn drop(&mut self) {
        if self.outcome.is_terminated() {
            return;
        }
        let Ok(runtime) = tokio::runtime::Handle::try_current() else { return };
        let (_, none) = oneshot::channel();
        let outcome = std::mem::replace(&mut self.outcome, none);
        let (service, map, operation) = (self.service.clone(), Arc::clone(self.map), self.operation);
        let told = async move {
            let Ok(Ok(committed)) = outcome.await else { return };
            if committed.removed > 0 {
                let change = Change::of_removal(map.version(committed.version()), committed.removed);
                let (caller, end) = (service.caller.as_ref(), End::DoneUnheard(change));
                service.tell(&Ended { operation, caller, map: Some(&map.name), end });
            }
        };
        runtime.spawn(told.in_current_span());
    }
}

/// The worker of the map is gone, by a defect.
pub(super) fn commit_thread_ended(_: tokio::sync::oneshot::error::RecvError) -> ServiceError {
    ServiceError::new(Reason::JobPanicked, "the change failed by a defect of the server")
}
