//! A change on its way into a map: what is handed to the map's queue, and what becomes of it.

use std::sync::Arc;

use tokio::sync::{OwnedMutexGuard, oneshot};
use uuid::Uuid;

use super::scan_turn::TurnLimits;
use crate::error::{Reason, ServiceError};
use crate::replication::{Base, NodeName, ReplicatedLog};
use crate::resources::Reservation;
use crate::work::{Requester, Share};
use mrol_map::map::{Change, Committed, MultiResolutionMap};
use mrol_map::util::StopSignal;
use mrol_store::{Pin, Record, Snapshot};

/// Keeps one robot's scans in order; held until its change is visible.
pub(crate) type RobotLock = Arc<OwnedMutexGuard<()>>;
/// Decides on a change when everything before it is applied; none where there is nothing to change. While it does, all
/// other changes of the map wait: it gives up where nobody waits for the answer any more.
pub(super) type Decision =
    Box<dyn FnOnce(&MultiResolutionMap, StopSignal<'_>) -> Result<Option<Decided>, Refusal> + Send + 'static>;

/// A change that was decided on in its turn.
pub(crate) struct Decided {
    pub(crate) change: Change,
    /// Where it was made before.
    pub(crate) record: Option<Record>,
    /// The memory that it takes.
    pub(crate) reserved: Vec<Reservation>,
    /// Keeps what it was made of until it is visible.
    pub(crate) pin: Option<Pin>,
}

/// A change on its way into the map.
pub(crate) enum Submission {
    /// Known.
    Prepared(Box<Prepared>),
    /// To be decided on.
    Undecided(Decision),
    /// What a node does about a map that several share. It is answered with the map's newest revision.
    Shared(SharedAct),
}

/// What a node does about a map that several share.
#[derive(Debug)]
pub(crate) enum SharedAct {
    /// Begins to share the map `map`, as `node`.
    Join { log: Arc<dyn ReplicatedLog>, node: NodeName, map: Uuid },
    /// Makes what the log has, unless the message of this number was read already.
    Follow { newest: Option<u64> },
    /// Claims to lead, unless the log names another in an epoch after `epoch`.
    Claim { epoch: Option<u64> },
    /// Takes over by its claim of this id, where none of the `live` nodes is ahead of this one, by the revisions that
    /// they had once they had read the claim.
    Open { claim: Option<Uuid>, live: Vec<(NodeName, u64)> },
    /// Gives the lead to another node.
    HandOver(NodeName),
    /// Tells where another node can begin to read, with a copy of this node's map as it is now or later; none where
    /// that would be in the middle of a change.
    #[cfg(test)]
    Base(oneshot::Sender<Option<Base>>),
    /// The same, with a copy of the map as it is there.
    Copy(oneshot::Sender<Option<(Base, Snapshot)>>),
}

/// A change that is known before its turn comes.
pub(crate) struct Prepared {
    pub(crate) change: Change,
    /// Where there is a journal.
    pub(crate) record: Option<Record>,
    /// The map's revision when it began to be decided on, or an earlier one. Where another node made changes since, it
    /// may have made this one, under the same id.
    pub(crate) seen: u64,
    /// True of a change that was decided on an empty map, and holds for no other.
    pub(crate) if_empty: bool,
    /// What a scan may still do when its turn comes.
    pub(crate) limits: TurnLimits,
    pub(crate) robot_lock: RobotLock,
    /// The memory that it takes.
    pub(crate) reservation: Reservation,
}

/// Why a change was not made.
#[derive(Debug, Clone)]
pub(crate) enum Refusal {
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

/// A request that is answered, or ready to go into the map.
pub(crate) enum Step<A> {
    /// The request changes nothing, or was done before: its answer.
    Answered(A),
    /// The change to be made, and what to say once it is.
    Ready(Submission, Box<dyn FnOnce(Committed) -> A + Send>),
}

/// A submission and its waiter.
pub(super) struct Waiting {
    pub(super) submission: Submission,
    pub(super) answer: oneshot::Sender<Outcome>,
    /// Whose turn it takes.
    pub(super) requester: Requester,
    /// Its place in the queue; none of what the process itself waits for.
    pub(super) _place: Option<Share>,
}

/// Closures have no form to print.
impl std::fmt::Debug for Waiting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Waiting")
    }
}

/// The record of a change.
pub(crate) fn record_of(change: &Change) -> Result<Record, ServiceError> {
    Record::of(change).map_err(|reason| ServiceError::new(Reason::RecordTooLarge, reason))
}
