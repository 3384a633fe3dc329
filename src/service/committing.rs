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

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use tokio::sync::{OwnedMutexGuard, oneshot, watch};

use super::{ErrorCode, ServiceError};
use crate::map::{Change, Committed, MapName, MultiResolutionMap};
use crate::store::{Durability, MapFolder, Record, StoreError};

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

/// Names without what is behind them: closures have no form to print.
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
    ) -> Result<Self, ServiceError> {
        let (inbox, waiting) = sync_channel(GROUP_MAX);
        let stopped = Arc::new(OnceLock::new());
        let thread = std::thread::Builder::new().name(format!("mrol-commit-{name}"));
        let worker = Worker { name, map, folder, announced, stopped: Arc::clone(&stopped), unsynced: None };
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

/// What a map's thread works with.
struct Worker {
    name: MapName,
    map: Arc<MultiResolutionMap>,
    folder: Option<Arc<MapFolder>>,
    announced: watch::Sender<u64>,
    stopped: Arc<OnceLock<Stop>>,
    /// Since when something waits to be synced at an interval.
    unsynced: Option<Instant>,
}

/// A change that is decided, with its record and the one who waits.
struct Decided {
    change: Change,
    record: Option<Record>,
    answer: oneshot::Sender<Outcome>,
    /// Kept until the change is visible.
    _turn: Option<Turn>,
}

impl Worker {
    fn run(mut self, inbox: &Receiver<Waiting>) {
        loop {
            match self.next(inbox) {
                Ok(first) => {
                    let rest = inbox.try_iter().take(GROUP_MAX - 1);
                    let waiting: Vec<Waiting> = std::iter::once(first).chain(rest).collect();
                    self.commit(waiting);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.sync_if_due();
        }
        self.sync();
    }

    fn next(&self, inbox: &Receiver<Waiting>) -> Result<Waiting, RecvTimeoutError> {
        match self.until_sync() {
            Some(rest) => inbox.recv_timeout(rest),
            None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
        }
    }

    /// Makes the changes that wait, in order; a run of known ones shares one sync.
    fn commit(&mut self, waiting: Vec<Waiting>) {
        let mut group = Vec::new();
        for Waiting { proposal, answer } in waiting {
            match proposal {
                Proposal::Prepared(prepared) => {
                    let Prepared { change, record, if_empty, turn } = *prepared;
                    if if_empty {
                        self.commit_group(&mut group);
                        if !self.map.is_empty() {
                            drop(answer.send(Err(Refusal::Stale)));
                            continue;
                        }
                    }
                    group.push(Decided { change, record, answer, _turn: Some(turn) });
                }
                Proposal::Undecided(decide) => {
                    self.commit_group(&mut group);
                    self.decide(decide, answer, &mut group);
                    self.commit_group(&mut group);
                }
            }
        }
        self.commit_group(&mut group);
    }

    fn decide(&self, decide: Decision, answer: oneshot::Sender<Outcome>, group: &mut Vec<Decided>) {
        let unchanged = Committed { revision: self.map.revision(), voxels: 0 };
        let decided = || match decide(&self.map)? {
            Some(change) => {
                let record = self.folder.as_ref().map(|_| record_of(&change)).transpose()?;
                Ok(Some((change, record)))
            }
            None => Ok(None),
        };
        match decided() {
            Ok(Some((change, record))) => group.push(Decided { change, record, answer, _turn: None }),
            Ok(None) => drop(answer.send(Ok(unchanged))),
            Err(refusal) => drop(answer.send(Err(refusal))),
        }
    }

    /// Durable, then visible, then acknowledged.
    fn commit_group(&mut self, group: &mut Vec<Decided>) {
        if group.is_empty() {
            return;
        }
        if let Err(error) = self.journal(group) {
            for Decided { answer, .. } in group.drain(..) {
                drop(answer.send(Err(Refusal::Failed(error.clone()))));
            }
            return;
        }
        for Decided { change, answer, .. } in group.drain(..) {
            let committed = self.map.committer().apply(&change);
            debug_assert_ne!(committed.revision, *self.announced.borrow(), "every record makes a revision");
            self.announced.send_replace(committed.revision);
            drop(answer.send(Ok(committed)));
        }
    }

    /// Appends a group and, where that is asked for, syncs it.
    fn journal(&mut self, group: &[Decided]) -> Result<(), ServiceError> {
        if let Some(stop) = self.stopped.get() {
            return Err(stop.refusal(&self.name));
        }
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        let records: Vec<&Record> = group.iter().filter_map(|decided| decided.record.as_ref()).collect();
        let durable = folder.append(&records).and_then(|_| match folder.settings().durability {
            Durability::Always => folder.sync(),
            Durability::Interval(_) => Ok(()),
        });
        durable.map_err(|error| self.stop(&error))?;
        self.unsynced.get_or_insert_with(Instant::now);
        Ok(())
    }

    /// From now on the map takes no changes: what the disk holds is unknown.
    fn stop(&self, error: &StoreError) -> ServiceError {
        tracing::error!(map = %self.name, %error, "the journal failed: the map is read only from now on");
        self.stopped.get_or_init(|| Stop::Failed(error.to_string())).refusal(&self.name)
    }

    /// How long until what was written is to be synced.
    fn until_sync(&self) -> Option<Duration> {
        let Durability::Interval(interval) = self.folder.as_ref()?.settings().durability else {
            return None;
        };
        Some(interval.saturating_sub(self.unsynced?.elapsed()))
    }

    fn sync_if_due(&mut self) {
        if self.until_sync().is_some_and(|rest| rest.is_zero()) {
            self.sync();
        }
    }

    fn sync(&mut self) {
        self.unsynced = None;
        if let (Some(folder), None) = (&self.folder, self.stopped.get())
            && let Err(error) = folder.sync()
        {
            self.stop(&error);
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.stopped.get_or_init(|| Stop::Failed("a defect of the server ended its thread".into()));
        }
    }
}

/// The record of a change.
pub(super) fn record_of(change: &Change) -> Result<Record, ServiceError> {
    Record::of(change)
        .map_err(|reason| ServiceError::new(ErrorCode::ResourceExhausted, "record_too_large", reason))
}
