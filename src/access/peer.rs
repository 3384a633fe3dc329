//! Where requests come from.

use std::net::IpAddr;

use mrol_service::Asker;

/// Where a request came from; whom it counts for where there is no key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Peer {
    /// An address.
    Address(IpAddr),
    /// A socket of this machine.
    Local,
}

impl std::fmt::Display for Peer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Address(address) => write!(f, "{address}"),
            Self::Local => f.write_str("local"),
        }
    }
}

/// Whom a request counts for: the key of this name, or where there is none the place that it came from.
pub fn asker_of(key: Option<&str>, peer: Option<&Peer>) -> Asker {
    match (key, peer) {
        (Some(key), _) => Asker::with_key(key),
        (None, Some(peer)) => Asker::at(peer),
        (None, None) => Asker::default(),
    }
}
