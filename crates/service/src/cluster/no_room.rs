//! A node without room for what others change.

use std::time::Duration;

use crate::error::{Reason, ServiceError};
use crate::replication::NodeName;
use mrol_map::map::MapName;

/// When to come again: whoever makes room takes longer than a beat.
const RETRY_AFTER: Duration = Duration::from_secs(5);

/// A node that holds a map and has no room for what makes it grow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoRoom {
    /// The node.
    pub node: NodeName,
    /// What it is short of: `DiskFull` or `MemoryFull`.
    pub reason: Reason,
}

impl NoRoom {
    /// The refusal of a change that makes the map grow. The node that leads could make it, and that node's copy would
    /// fall behind or take its server down.
    pub(crate) fn refusal(&self, map: &MapName) -> ServiceError {
        let Self { node, reason } = self;
        let message = format!(
            "node {node}, which holds map {map} as well, has no room for more ({}): make room there, delete voxels, or take the \
             map off it (`mrol cluster copies`)",
            reason.as_str()
        );
        ServiceError::new(*reason, message).retry_after(RETRY_AFTER)
    }
}
