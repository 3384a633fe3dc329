//! Maps and nodes that a command names.

use mrol::console::CliError;
use mrol_cluster::{Overview, SeenMap, SeenNode};
use mrol_map::map::MapName;
use mrol_service::replication::NodeName;

/// The map of that name.
///
/// # Errors
/// Names those that are listed, where it is not.
pub(super) fn known_map<'a>(seen: &'a Overview, map: &MapName) -> Result<&'a SeenMap, CliError> {
    seen.map(map).ok_or_else(|| {
        let maps = listed(seen.maps.iter().map(|map| map.name.to_string()).collect());
        CliError::failed(format!("map {map} is none of the cluster's, which are: {maps}"))
    })
}

/// The node of that name.
///
/// # Errors
/// Names those that have ever beaten, where it has not.
pub(super) fn known_node<'a>(seen: &'a Overview, node: &NodeName) -> Result<&'a SeenNode, CliError> {
    seen.node(node).ok_or_else(|| {
        let nodes = listed(seen.nodes.iter().map(|node| node.node.to_string()).collect());
        CliError::failed(format!("node {node} is none of the cluster's, which are: {nodes}"))
    })
}

fn listed(names: Vec<String>) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
