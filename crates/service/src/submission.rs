//! A change on its way into a map: what is handed to the map's thread, and what becomes of it.

use std::sync::Arc;

use tokio::sync::{OwnedMutexGuard, oneshot};

use super::commit_queue::TurnLimits;
use super::resource_budget::Reservation;
use super::{Reason, ServiceError};
use mrol_map::map::{Change, Committed, MultiResolutionMap};
use mrol_map::util::StopSignal;
use mrol_store::{Pin, Record};

/// Keeps one robot's scans in order; held until its change is visible.
pub(super) type RobotLock = Arc<OwnedMutexGuard<()>>;
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
    pub(super) robot_lock: RobotLock,
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

/// A submission with the one who waits for it.
pub(super) struct Waiting {
    pub(super) submission: Submission,
    pub(super) answer: oneshot::Sender<Outcome>,
}

/// Closures have no form to print.
impl std::fmt::Debug for Waiting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Waiting")
    }
}

/// The record of a change.
pub(super) fn record_of(change: &Change) -> Result<Record, ServiceError> {
    Record::of(change).map_err(|reason| ServiceError::new(Reason::RecordTooLarge, reason))
}
