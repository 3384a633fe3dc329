//! Which node makes the changes of a map.

use uuid::Uuid;

use crate::replication::{Member, NodeName};

/// Which node makes the changes of a map, as far as this server knows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lead {
    /// This server, which shares the map with nobody.
    Alone,
    /// Nobody here yet: this server is a node of a cluster, and the map has not joined its log.
    NotJoined,
    /// What the log of the map says.
    Shared {
        /// The node that the log names; none before the first claim.
        leader: Option<NodeName>,
        /// True where that is this one, and it has taken over.
        is_here: bool,
        /// True where that is this one, and it claimed since it was started: it takes over once it knows how far the
        /// others are.
        has_claimed: bool,
        /// How many claims there were.
        epoch: u64,
        /// The id of the last, where this node has read it. The number of claims alone does not say which log was read:
        /// where an older copy of it is put back, another claim gets the number.
        claim: Option<Uuid>,
        /// Number of the last message of the log that was read.
        sequence: u64,
        /// False where this node cannot tell whether its history is the log's: it takes over from nobody.
        agrees: bool,
    },
}

impl Lead {
    pub(super) fn of(member: &Member) -> Self {
        Self::Shared {
            leader: member.leader().cloned(),
            is_here: member.leads(),
            has_claimed: member.has_claimed(),
            epoch: member.epoch(),
            claim: member.last_claim(),
            sequence: member.position().sequence,
            agrees: member.agrees(),
        }
    }
}
