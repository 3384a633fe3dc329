//! Where a map is to be.

use mrol_service::replication::NodeName;

use super::holders::Holders;

/// Where a map is to be: which nodes hold it, and which of them leads.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Placement {
    /// The nodes that hold it.
    pub holders: Holders,
    /// The node that is to lead it whenever it can; none where any holder will do.
    pub leader: Option<NodeName>,
}
