//! Why a map takes no more changes, and what its callers are told then.

use std::time::Duration;

use crate::error::{Reason, ServiceError};
use crate::replication::NodeName;
use mrol_map::map::{MapName, REVISION_MAX};
use mrol_store::StoreError;

/// When to try again where a node is to take over, or the log to answer.
const LEADER_SOON: Duration = Duration::from_secs(2);

/// Why a map takes no more changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Stop {
    /// The map's journal could not be written: what the disk holds is unknown.
    Failed(String),
    /// Several nodes share the map, and this one has another history of it than their log.
    Diverged(String),
    /// Several nodes share the map, and their log begins behind what this one has: a copy of the map as it is there is
    /// to take its place.
    Behind(String),
    /// The map was deleted.
    Deleted,
    /// Other nodes hold the map, and this one does not any more.
    HeldElsewhere,
    /// Another has its name now.
    Replaced,
    /// It has another name now, which whoever knows this one may not know.
    Renamed,
}

impl Stop {
    /// The error for requests that would change the map.
    pub(crate) fn refusal(&self, name: &MapName) -> ServiceError {
        match self {
            Self::Failed(reason) => {
                let message = format!(
                    "map {name} is read only since its journal failed ({reason}): restart the server when the disk \
                     is well"
                );
                ServiceError::new(Reason::MapReadOnly, message)
            }
            Self::Diverged(how) | Self::Behind(how) => {
                let message = format!("map {name} takes no changes on this node: {how}");
                ServiceError::new(Reason::HistoriesDiffer, message)
            }
            Self::Deleted => ServiceError::new(Reason::MapNotFound, format!("map {name} was deleted")),
            Self::HeldElsewhere => {
                let message =
                    format!("map {name} is not held by this node any more: ask again, and be sent on");
                ServiceError::new(Reason::MapElsewhere, message)
            }
            Self::Replaced => {
                let message = format!("map {name} was replaced by another: ask for its map_uuid");
                ServiceError::new(Reason::MapReplaced, message)
            }
            Self::Renamed => {
                let message =
                    format!("map {name} was renamed: list the maps, and ask under the name that it has now");
                ServiceError::new(Reason::MapNotFound, message)
            }
        }
    }
}

/// What to say to whose change was handed to a journal that failed then.
pub(super) fn outcome_unknown(name: &MapName, error: &StoreError) -> ServiceError {
    let message = format!(
        "the journal of map {name} failed while this change was written ({error}): it may be there after the next \
         restart of the server; the same scan_id or request_id, sent again then, tells"
    );
    ServiceError::new(Reason::OutcomeUnknown, message)
}

/// What to say where the map has no revision left.
pub(super) fn revisions_used_up(name: &MapName) -> ServiceError {
    let message = format!(
        "map {name} is at revision {REVISION_MAX}, the last that there is: make another map, and insert there"
    );
    ServiceError::new(Reason::RevisionsUsedUp, message)
}

/// The refusal of a change that another node has to make.
pub(crate) fn not_leader(name: &MapName, leader: Option<&NodeName>) -> ServiceError {
    let message = match leader {
        Some(leader) => format!("node {leader} makes the changes of map {name}: ask there"),
        None => format!("no node has taken over map {name} yet: try again"),
    };
    ServiceError::new(Reason::NotLeader, message).retry_after(LEADER_SOON)
}

/// The refusal of a change of a map that waits for its log.
pub(super) fn not_joined(name: &MapName) -> ServiceError {
    let message = format!(
        "map {name} of this node has not joined its log: it does so once NATS answers, or was never taken into the cluster \
         (`mrol cluster status` tells, `mrol cluster adopt` takes it in)"
    );
    ServiceError::new(Reason::NoQuorum, message).retry_after(LEADER_SOON)
}

/// The refusal to follow or lead a map that has no log yet.
pub(super) fn not_shared(name: &MapName) -> ServiceError {
    ServiceError::new(Reason::NotLeader, format!("map {name} has no log yet: share it first"))
}

/// The error of a change that is in the log, after which this node's folder failed.
pub(super) fn not_kept(name: &MapName, error: &ServiceError) -> ServiceError {
    let message = format!(
        "this change of map {name} is in its log, and this node could not keep it ({error}): other nodes make it; the same \
         scan_id or request_id, sent to one of them, tells"
    );
    ServiceError::new(Reason::OutcomeUnknown, message)
}

/// The refusal where the log of a map does not answer: nothing was changed.
pub(super) fn no_quorum(name: &MapName, reason: &str) -> ServiceError {
    let message =
        format!("the log of map {name} acknowledges nothing ({reason}): nothing was changed, try again");
    ServiceError::new(Reason::NoQuorum, message).retry_after(LEADER_SOON)
}

/// The error of a change that was handed to a log which did not answer.
pub(super) fn not_acknowledged(name: &MapName, reason: &str) -> ServiceError {
    let message = format!(
        "the log of map {name} did not acknowledge this change ({reason}): it may be there, now or later; the same scan_id or \
         request_id, sent again, tells"
    );
    ServiceError::new(Reason::OutcomeUnknown, message).retry_after(LEADER_SOON)
}
