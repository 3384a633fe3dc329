//! What a node knows of its cluster.

use std::sync::Arc;

use super::forward::Forward;
use super::shared_catalog::SharedCatalog;
use crate::replication::NodeName;

/// What a node knows of its cluster.
#[derive(Debug, Clone)]
pub struct Cluster {
    /// This node.
    pub node: NodeName,
    /// How it asks the others.
    pub forward: Arc<dyn Forward>,
    /// The maps that all share.
    pub catalog: Arc<dyn SharedCatalog>,
}
