//! `mrol cluster forget`: takes a node that left for good off the list of nodes.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::nats::NatsOptions;
use mrol::console::parse;
use mrol::console::{CliError, Output};
use mrol_cluster::{Holders, NodeBeat, Overview, SeenMap};
use mrol_service::replication::NodeName;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster forget n3 --nats nats://10.0.0.1:4222     machine n3 is gone, and does not come back

A node that is silent may come back with changes that no other has, so the cluster remembers it, and the maps that were deleted
meanwhile. Forget a node once its data folder is gone or is to be wiped. Started again under its name it is a node like any other.";

/// Take a node that left for good off the list of nodes
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Forget {
    /// The node, which does not beat any more
    #[arg(value_name = "NODE", value_parser = parse::node_name)]
    node: NodeName,
    #[command(flatten)]
    nats: NatsOptions,
}

impl Forget {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let reader = self.nats.reader()?;
        check_silent(&reader.settled().map_err(CliError::failed)?, &self.node)?;
        let beats = reader.store().beats.read().map_err(CliError::failed)?;
        // The one that was looked at last: where the node has beaten meanwhile, nothing is removed.
        let last: Option<NodeBeat> = beats.into_iter().find(|beat| beat.node == self.node);
        if let Some(last) = last {
            reader.store().beats.remove(&last).map_err(CliError::failed)?;
        }
        output.print(&Forgotten { node: self.node.to_string() })
    }
}

/// Refuses a node that nobody has heard of, and one that is live.
fn check_silent(seen: &Overview, node: &NodeName) -> Result<(), CliError> {
    match seen.node(node) {
        None => {
            let nodes: Vec<_> = seen.nodes.iter().map(|seen| seen.node.to_string()).collect();
            let nodes = if nodes.is_empty() { "none".to_owned() } else { nodes.join(", ") };
            Err(CliError::failed(format!("node {node} is none of the cluster's, which are: {nodes}")))
        }
        Some(_) if !only_at(seen, node).is_empty() => {
            let maps = only_at(seen, node).join(", ");
            Err(CliError::failed(format!(
                "node {node} is the only one left that holds {maps}: put them on others first (`mrol cluster copies MAP NODE`), \
                 or delete them"
            )))
        }
        Some(seen) if seen.is_live => Err(CliError::failed(format!(
            "node {node} is live, at {}: a node is forgotten once it has ended for good",
            seen.beat.grpc
        ))),
        Some(_) => Ok(()),
    }
}

/// The maps that no other node holds of which anybody knows.
fn only_at(seen: &Overview, node: &NodeName) -> Vec<String> {
    let is_only = |map: &&SeenMap| match &map.holders {
        Holders::All => false,
        Holders::Only(nodes) => {
            nodes.contains(node) && !nodes.iter().any(|it| it != node && seen.node(it).is_some())
        }
    };
    seen.maps.iter().filter(is_only).map(|map| map.name.to_string()).collect()
}

#[derive(Serialize)]
struct Forgotten {
    node: String,
}

impl Display for Forgotten {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "node {} is forgotten", self.node)
    }
}

#[cfg(test)]
mod tests {
    use mrol_cluster::{Beat, SeenNode};
    use mrol_map::map::MapName;
    use uuid::Uuid;

    use super::*;

    #[test]
    fn only_a_node_that_is_there_no_more_is_forgotten() {
        let seen = |name: &str, is_live| SeenNode {
            node: NodeName::new(name).unwrap(),
            is_live,
            beat: Beat {
                grpc: "http://10.0.0.1:7334".to_owned(),
                record_version: 1,
                has_ended: !is_live,
                ..Beat::default()
            },
        };
        let map = |name: &str, holders: &[&str]| SeenMap {
            name: MapName::new(name).unwrap(),
            uuid: Uuid::nil(),
            wished: None,
            holders: Holders::Only(holders.iter().map(|name| NodeName::new(name).unwrap()).collect()),
            copies: Vec::new(),
        };
        let maps = vec![map("hall", &["n2", "n3"]), map("yard", &["n3", "n0"])];
        let seen = Overview { nodes: vec![seen("n1", true), seen("n2", false), seen("n3", false)], maps };
        let refused = |name: &str| {
            check_silent(&seen, &NodeName::new(name).unwrap()).map_err(|error| error.to_string())
        };
        assert_eq!(refused("n2"), Ok(()));
        assert!(refused("n1").unwrap_err().contains("node n1 is live, at http://10.0.0.1:7334"));
        assert_eq!(refused("n9").unwrap_err(), "node n9 is none of the cluster's, which are: n1, n2, n3");
        assert!(
            refused("n3")
                .unwrap_err()
                .contains("node n3 is the only one left that holds yard: put them on others")
        );
    }
}
