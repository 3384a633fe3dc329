//! A data folder is of a server by itself, or of one node of a cluster.

use super::opening::not_stored;
use crate::cluster::Cluster;
use crate::error::{Reason, ServiceError};
use mrol_store::DataDir;

/// Refuses a folder that belongs to somebody else, and notes that it belongs to this node from now on. What a server
/// changed by itself, or under the name of another node, would part the histories of its maps.
pub(super) fn check_node(data_dir: &DataDir, cluster: Option<&Cluster>) -> Result<(), ServiceError> {
    let there = data_dir.node().map_err(not_stored)?;
    let message = match (cluster, there) {
        (None, None) => return Ok(()),
        (Some(cluster), None) => return data_dir.set_node(cluster.node.as_str()).map_err(not_stored),
        (Some(cluster), Some(there)) if cluster.node.as_str() == there => return Ok(()),
        (Some(Cluster { node, .. }), Some(there)) => {
            format!(
                "the data folder belongs to node {there}: start with cluster.node = {there:?}, not \"{node}\""
            )
        }
        (None, Some(there)) => format!(
            "the data folder belongs to node {there} of a cluster: start with --cluster, or take it out of the cluster for \
             good with --leave-cluster"
        ),
    };
    Err(ServiceError::new(Reason::BadSettings, message))
}
