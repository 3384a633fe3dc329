//! What a node of a cluster says of a request that it forwards for a caller of its own.

use axum::http::{HeaderMap, HeaderValue};

use super::key::KeyName;
use mrol_client::wire::{CALLER, NODE};
use mrol_service::replication::NodeName;

/// What a request says of where it was asked first. Anybody can say that: it counts for who shows the secret of the
/// cluster.
#[derive(Debug, Clone, Default)]
pub(super) struct Forwarding {
    /// The node that forwards it.
    pub(super) node: Option<NodeName>,
    /// For whom it does.
    pub(super) caller: ForwardedCaller,
}

/// For whom a node says that it asks.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) enum ForwardedCaller {
    /// For anybody: its callers show no keys.
    #[default]
    Anybody,
    /// For the holder of the key of this name.
    HolderOf(KeyName),
    /// For the holder of a key whose name is none.
    Unreadable,
}

impl Forwarding {
    /// Takes it out of a request's headers, so that nothing further in can believe it.
    pub(super) fn taken_from(headers: &mut HeaderMap) -> Self {
        let (node, caller) = (headers.remove(NODE), headers.remove(CALLER));
        let text = |value: &HeaderValue| value.to_str().unwrap_or_default().to_owned();
        let name = |value: HeaderValue| KeyName::new(&text(&value));
        Self {
            node: node.and_then(|node| NodeName::new(&text(&node)).ok()),
            caller: match caller.map(name) {
                None => ForwardedCaller::Anybody,
                Some(Some(name)) => ForwardedCaller::HolderOf(name),
                Some(None) => ForwardedCaller::Unreadable,
            },
        }
    }
}
