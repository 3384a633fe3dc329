//! How changes become durable, then visible, then acknowledged.
//!
//! ```text
//! many threads                one thread a map
//!
//! align, quantise, encode --> take all that wait
//!                             append to the journal   they take their revisions here
//!                             sync                    once for all of them
//!                             apply                   in the order of revisions
//!                             publish, acknowledge
//! ```
//!
//! A change whose content follows from the map (which voxels are there to be deleted) is decided when everything
//! before it is applied and nothing after it has begun.

mod worker;

use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};

use tokio::sync::{OwnedMutexGuard, oneshot, watch};

use super::room::Promise;
use super::{ErrorCode, ServiceError};
use crate::map::{Change, Committed, MapName, MultiResolutionMap};
use crate::store::{MapFolder, Record, StoreSettings};
use worker::Worker;

/// Changes that share one sync, and as many that wait meanwhile; who has one more waits with it in hand.
const GROUP_MAX: usize = 256;

/// Keeps one robot's scans in order; held until its change is visible.
pub(super) type Turn = Arc<OwnedMutexGuard<()>>;
/// Decides on a change when everything before it is applied; none where there is nothing to change.
pub(super) type Decision =
    Box<dyn FnOnce(&MultiResolutionMap) -> Result<Option<Change>, Refusal> + Send + 'static>;

/// A change on its way into the map.
pub(super) enum Proposal {
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
    /// It was decided on an empty map, and holds for no other.
    pub(super) if_empty: bool,
    pub(super) turn: Turn,
    /// The memory that it takes.
    pub(super) promise: Promise,
}

/// Why a change was not made.
#[derive(Debug)]
pub(super) enum Refusal {
    /// The map has changed since it was decided on: decide again.
    Stale,
    /// It cannot be made.
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
    /// It changes nothing, or was done before.
    Answered(A),
    /// What becomes of it will be known, and then what to say.
    Proposed(oneshot::Receiver<Outcome>, Box<dyn FnOnce(Committed) -> A + Send>),
}

/// A proposal with the one who waits for it.
struct Waiting {
    proposal: Proposal,
    answer: oneshot::Sender<Outcome>,
}

/// The way into a map. Dropping it ends the map's thread, after the changes that wait.
#[derive(Debug)]
pub(super) struct Committing {
    inbox: SyncSender<Waiting>,
    stopped: Arc<OnceLock<Stop>>,
}

/// Closures have no form to print.
impl std::fmt::Debug for Waiting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Waiting")
    }
}

impl Committing {
    /// Starts the thread of a map. `announced` is told of each revision.
    pub(super) fn start(
        name: MapName,
        map: Arc<MultiResolutionMap>,
        folder: Option<Arc<MapFolder>>,
        announced: watch::Sender<u64>,
        settings: &StoreSettings,
    ) -> Result<Self, ServiceError> {
        let (inbox, waiting) = sync_channel(GROUP_MAX);
        let stopped = Arc::new(OnceLock::new());
        let thread = std::thread::Builder::new().name(format!("mrol-commit-{name}"));
        let worker = Worker::new(name, map, folder, announced, Arc::clone(&stopped), settings);
        let started = thread.spawn(move || worker.run(&waiting));
        started.map_err(|e| ServiceError::new(ErrorCode::Internal, "no_threads", e.to_string()))?;
        Ok(Self { inbox, stopped })
    }

    /// Hands a change over, not from an async thread; its outcome comes when it is visible, and with [`Durability::Always`] durable.
    pub(super) fn propose(&self, proposal: Proposal) -> oneshot::Receiver<Outcome> {
        let (answer, outcome) = oneshot::channel();
        // Where the thread is gone, so is the sender of the outcome.
        drop(self.inbox.send(Waiting { proposal, answer }));
        outcome
    }

    /// Why the map takes no more changes.
    pub(super) fn stopped(&self) -> Option<&Stop> {
        self.stopped.get()
    }

    /// The map is deleted: it takes no more changes.
    pub(super) fn end(&self) {
        self.stopped.get_or_init(|| Stop::Deleted);
    }
}

/// Why a map takes no more changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Stop {
    /// Its journal could not be written: what the disk holds is unknown.
    Failed(String),
    /// It was deleted.
    Deleted,
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
                ServiceError::new(ErrorCode::Unavailable, "map_read_only", message)
            }
            Self::Deleted => {
                ServiceError::new(ErrorCode::NotFound, "map_not_found", format!("map {name} was deleted"))
            }
        }
    }
}

/// The record of a change.
pub(super) fn record_of(change: &Change) -> Result<Record, ServiceError> {
    Record::of(change)
        .map_err(|reason| ServiceError::new(ErrorCode::ResourceExhausted, "record_too_large", reason))
}
