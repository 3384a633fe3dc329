//! A data folder is of a server by itself, or of one node of a cluster.

use super::opening::not_stored;
use crate::cluster::Cluster;
use crate::error::{Reason, ServiceError};
use crate::settings::{Adoption, ServiceSettings};
use mrol_store::DataDir;

/// Refuses a folder that belongs to somebody else, and notes that it belongs to this node from now on. What a server
/// changed by itself, or under the name of another node, would part the histories of its maps.
pub(super) fn check_node(data_dir: &DataDir, settings: &ServiceSettings) -> Result<(), ServiceError> {
    let there = data_dir.node().map_err(not_stored)?;
    let message = match (settings.cluster.as_ref(), there.as_deref()) {
        (None, None) if settings.adoption == Some(Adoption::OfNode) => {
            "the data folder belongs to no node of a cluster: adopt it without --of-node".to_owned()
        }
        (None, None) => return Ok(()),
        (Some(Cluster { node, .. }), None | Some("")) => {
            return data_dir.set_node(node.as_str()).map_err(not_stored);
        }
        (Some(Cluster { node, .. }), Some(there)) if node.as_str() == there => return Ok(()),
        (Some(Cluster { node, .. }), Some(there)) => {
            format!(
                "the data folder belongs to node {there}: start with cluster.node = {there:?}, not \"{node}\""
            )
        }
        (None, Some("")) if settings.adoption.is_some() => return Ok(()),
        (None, Some(_)) if settings.adoption == Some(Adoption::OfNode) => return Ok(()),
        (None, Some("")) => "maps of the data folder were adopted by a cluster: start with --cluster and --node, or take it out \
                             of the cluster for good with --leave-cluster"
            .to_owned(),
        (None, Some(there)) => format!(
            "the data folder belongs to node {there} of a cluster: start with --cluster, or take it out of the cluster for \
             good with --leave-cluster"
        ),
    };
    Err(ServiceError::new(Reason::BadSettings, message))
}
