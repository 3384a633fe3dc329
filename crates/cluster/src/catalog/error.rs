//! Why the list of maps was not read or changed.

use mrol_map::map::MapName;
use uuid::Uuid;

/// Why the list was not read or changed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CatalogError {
    /// Nobody answered, and nothing was changed.
    #[error("{0}")]
    Unavailable(String),
    /// Nobody acknowledged a change: it is there, or not.
    #[error("{0}")]
    Unknown(String),
    /// What is there is no list of maps.
    #[error("the list of maps cannot be read: {0}")]
    Damaged(String),
    /// No more maps can be listed.
    #[error("the cluster's list of maps is full: delete one first")]
    Full,
    /// The map is listed under another name.
    #[error("the map is in the cluster already, as map {0}")]
    OtherName(MapName),
    /// The map of this uuid was deleted on all nodes: each would delete its copy again.
    #[error(
        "map {0} was deleted in the cluster: restore a copy of it, which gets another uuid (`mrol restore`)"
    )]
    Deleted(Uuid),
}
