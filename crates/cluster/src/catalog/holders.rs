//! Which nodes hold a map.

use std::collections::BTreeSet;

use mrol_service::replication::NodeName;

/// The nodes that hold a map.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Holders {
    /// All nodes of the cluster, those that join later among them.
    #[default]
    All,
    /// These.
    Only(BTreeSet<NodeName>),
}

impl Holders {
    /// True of a node that holds the map.
    pub fn contains(&self, node: &NodeName) -> bool {
        match self {
            Self::All => true,
            Self::Only(nodes) => nodes.contains(node),
        }
    }

    /// The names of the nodes; none where all nodes hold it.
    pub fn names(&self) -> impl Iterator<Item = &NodeName> {
        let named = match self {
            Self::All => None,
            Self::Only(nodes) => Some(nodes),
        };
        named.into_iter().flatten()
    }
}

impl std::fmt::Display for Holders {
    /// The names with commas between them, or `all`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::All => f.write_str("all"),
            Self::Only(nodes) => {
                let names: Vec<&str> = nodes.iter().map(NodeName::as_str).collect();
                f.write_str(&names.join(","))
            }
        }
    }
}
