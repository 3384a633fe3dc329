//! Which node makes the changes of a map.

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
        /// How many claims there were.
        epoch: u64,
        /// Number of the last message of the log that was read.
        sequence: u64,
    },
}

impl Lead {
    pub(super) fn of(member: &Member) -> Self {
        Self::Shared {
            leader: member.leader().cloned(),
            is_here: member.leads(),
            epoch: member.epoch(),
            sequence: member.position().sequence,
        }
    }
}
