//! How changes become durable, then visible, then acknowledged.
//!
//! ```text
//! many threads                one thread a map
//!
//! align, quantize, encode --> take all that wait
//!                             append to the journal   they take their revisions here
//!                             sync                    once for all of them
//!                             apply                   in the order of revisions
//!                             publish, acknowledge
//! ```
//!
//! A change whose content follows from the map (which voxels are there to be deleted) is decided when everything
//! before it is applied and nothing after it has begun.

mod scan_turn;
mod worker;

use std::sync::{Arc, OnceLock};

use tokio::sync::{OwnedMutexGuard, oneshot, watch};

use super::recent_changes::RecentChanges;
use super::resource_budget::Reservation;
use super::{Reason, ServiceError};
use mrol_map::map::{Change, Committed, MapName, MultiResolutionMap, REVISION_MAX};
use mrol_map::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use mrol_map::sync::thread;
use mrol_map::util::{Durations, SharedDurations, StopSignal};
use mrol_store::{MapFolder, Pin, Record, StoreError, StoreSettings};
pub(super) use scan_turn::TurnLimits;
use worker::Worker;

/// Changes that share one sync, and as many that wait meanwhile; one more is refused.
const GROUP_MAX: usize = 256;

/// Keeps one robot's scans in order; held until its change is visible.
pub(super) type Turn = Arc<OwnedMutexGuard<()>>;
/// Decides on a change when everything before it is applied; none where there is nothing to change. While it does, all
/// other changes of the map wait: it gives up where nobody waits for the answer any more.
pub(super) type Decision =
    Box<dyn FnOnce(&MultiResolutionMap, StopSignal<'_>) -> Result<Option<Decided>, Refusal> + Send + 'static>;

/// A change that was decided on in its turn.
pub(super) struct Decided {
    pub(super) change: Change,
    /// Where it was made before.
    pub(super) record: Option<Record>,
    /// The memory that it takes.
    pub(super) lent: Vec<Reservation>,
    /// Keeps what it was made of until it is visible.
    pub(super) pin: Option<Pin>,
}

/// A change on its way into the map.
pub(super) enum Submission {
    /// Known.
    Prepared(Box<Prepared>),
    /// To be decided on.
    Undecided(Decision),
}

/// A change that is known before its turn comes.
pub(super) struct Prepared {
    pub(super) change: Change,
    /// Where there is a journal.
    pub(super) record: Option<Record>,
    /// True of a change that was decided on an empty map, and holds for no other.
    pub(super) if_empty: bool,
    /// What a scan may still do when its turn comes.
    pub(super) limits: TurnLimits,
    pub(super) turn: Turn,
    /// The memory that it takes.
    pub(super) reservation: Reservation,
}

/// Why a change was not made.
#[derive(Debug)]
pub(super) enum Refusal {
    /// The map has changed since it was decided on: decide again.
    Stale,
    /// The change cannot be made.
    Failed(ServiceError),
}

impl From<ServiceError> for Refusal {
    fn from(error: ServiceError) -> Self {
        Self::Failed(error)
    }
}

pub(super) type Outcome = Result<Committed, Refusal>;

/// A request that is answered, or on its way into the map.
pub(super) enum Step<A> {
    /// The request changes nothing, or was done before: its answer.
    Answered(A),
    /// What becomes of it will be known, and then what to say.
    Submitted(oneshot::Receiver<Outcome>, Box<dyn FnOnce(Committed) -> A + Send>),
}

/// Who is told of a change when it is visible.
pub(super) struct Told {
    /// Those who wait for a revision.
    pub(super) announced: watch::Sender<u64>,
    /// Those who watch the map.
    pub(super) recent: Arc<RecentChanges>,
}

/// A submission with the one who waits for it.
struct Waiting {
    submission: Submission,
    answer: oneshot::Sender<Outcome>,
}

/// The way into a map. Dropping it ends the map's thread, after the changes that wait.
#[derive(Debug)]
pub(super) struct CommitQueue {
    inbox: SyncSender<Waiting>,
    stopped: Arc<OnceLock<Stop>>,
    /// True once no other revision will come: those who wait for one hold the map, and so its thread.
    ended: watch::Sender<bool>,
    durations: Arc<SharedDurations>,
}

/// Closures have no form to print.
impl std::fmt::Debug for Waiting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Waiting")
    }
}

/// The thread of a map that is not there yet. It is started before anything is done on the disk, so that what was done
/// there never lacks a thread; dropped, it ends.
pub(super) struct CommitThread(SyncSender<(Worker, Receiver<Waiting>)>);

impl CommitThread {
    /// Starts the thread of a map of that name.
    ///
    /// # Errors
    /// When the system has no thread left.
    pub(super) fn start(name: &MapName) -> Result<Self, ServiceError> {
        let (begin, begun) = sync_channel::<(Worker, Receiver<Waiting>)>(1);
        let thread = thread::Builder::new().name(format!("mrol-commit-{name}"));
        let started = thread.spawn(move || {
            if let Ok((worker, waiting)) = begun.recv() {
                worker.run(&waiting);
            }
        });
        let no_threads = |e: std::io::Error| ServiceError::new(Reason::NoThreads, e.to_string());
        started.map_err(no_threads).map(|_| Self(begin))
    }
}

impl CommitQueue {
    /// Gives `thread` a map.
    pub(super) fn begin(
        thread: CommitThread,
        name: MapName,
        map: Arc<MultiResolutionMap>,
        folder: Option<Arc<MapFolder>>,
        told: Told,
        settings: &StoreSettings,
    ) -> Self {
        let (inbox, waiting) = sync_channel(GROUP_MAX);
        let stopped = Arc::new(OnceLock::new());
        let durations = Arc::<SharedDurations>::default();
        let worker =
            Worker::new(name, map, folder, told, Arc::clone(&stopped), Arc::clone(&durations), settings);
        // It waits for just this.
        drop(thread.0.send((worker, waiting)));
        Self { inbox, stopped, ended: watch::Sender::new(false), durations }
    }

    /// Hands a change over; its outcome comes when it is visible, and with [`Durability::Always`] durable. Does not
    /// wait: the thread of a map whose disk hangs takes nothing from its queue, and who waited for a place in it would
    /// keep a thread from the other maps.
    ///
    /// # Errors
    /// `ResourceExhausted` where the queue is full.
    pub(super) fn submit(&self, submission: Submission) -> Result<oneshot::Receiver<Outcome>, ServiceError> {
        let (answer, outcome) = oneshot::channel();
        match self.inbox.try_send(Waiting { submission, answer }) {
            // Where the thread is gone, so is the sender of the outcome.
            Ok(()) | Err(TrySendError::Disconnected(_)) => Ok(outcome),
            Err(TrySendError::Full(_)) => Err(ServiceError::overloaded(format!(
                "{GROUP_MAX} changes of this map wait for its disk already: try again"
            ))),
        }
    }

    /// How long groups of changes took to become durable and visible.
    pub(super) fn durations(&self) -> Durations {
        self.durations.read()
    }

    /// Why the map takes no more changes.
    pub(super) fn stopped(&self) -> Option<&Stop> {
        self.stopped.get()
    }

    /// The map is deleted: it takes no more changes.
    pub(super) fn end(&self) {
        self.stopped.get_or_init(|| Stop::Deleted);
        self.ended.send_replace(true);
    }

    /// Waits until the map is deleted or replaced.
    pub(super) async fn ended(&self) {
        // The sender is there as long as this is.
        drop(self.ended.subscribe().wait_for(|ended| *ended).await);
    }

    /// Another map takes its place: it takes no more changes here, and when this returns, none is on its way.
    pub(super) fn end_replaced(&self) {
        self.stopped.get_or_init(|| Stop::Replaced);
        let (answer, behind_all) = oneshot::channel();
        let submission = Submission::Undecided(Box::new(|_, _| Ok(None)));
        // Waits for a place in the queue; where the thread is gone, so are its changes.
        if self.inbox.send(Waiting { submission, answer }).is_ok() {
            drop(behind_all.blocking_recv());
        }
        self.ended.send_replace(true);
    }
}

/// Why a map takes no more changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Stop {
    /// The map's journal could not be written: what the disk holds is unknown.
    Failed(String),
    /// The map was deleted.
    Deleted,
    /// Another has its name now.
    Replaced,
}

impl Stop {
    /// What to say to who wants to change the map.
    pub(super) fn refusal(&self, name: &MapName) -> ServiceError {
        match self {
            Self::Failed(reason) => {
                let message = format!(
                    "map {name} is read only since its journal failed ({reason}): restart the server when the disk \
                     is well"
                );
                ServiceError::new(Reason::MapReadOnly, message)
            }
            Self::Deleted => ServiceError::new(Reason::MapNotFound, format!("map {name} was deleted")),
            Self::Replaced => {
                let message = format!("map {name} was replaced by another: ask for its map_uuid");
                ServiceError::new(Reason::MapReplaced, message)
            }
        }
    }
}

/// What to say to whose change was handed to a journal that failed then.
fn outcome_unknown(name: &MapName, error: &StoreError) -> ServiceError {
    let message = format!(
        "the journal of map {name} failed while this change was written ({error}): it may be there after the next \
         restart of the server; the same scan_id or request_id, sent again then, tells"
    );
    ServiceError::new(Reason::OutcomeUnknown, message)
}

/// What to say where the map has no revision left.
fn revisions_used_up(name: &MapName) -> ServiceError {
    let message = format!(
        "map {name} is at revision {REVISION_MAX}, the last that there is: make another map, and insert there"
    );
    ServiceError::new(Reason::RevisionsUsedUp, message)
}

/// The record of a change.
pub(super) fn record_of(change: &Change) -> Result<Record, ServiceError> {
    Record::of(change).map_err(|reason| ServiceError::new(Reason::RecordTooLarge, reason))
}
