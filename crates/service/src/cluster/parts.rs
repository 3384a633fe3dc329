//! What a node knows of its cluster.

use std::pin::Pin;
use std::sync::Arc;

use super::forward::Forward;
use super::shared_catalog::SharedCatalog;
use crate::replication::NodeName;

/// What comes later.
pub type Later<'a, T> = Pin<Box<dyn Future<Output = T> + Send + 'a>>;

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
