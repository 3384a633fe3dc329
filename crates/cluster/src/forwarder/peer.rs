//! The connections to another node.

use std::sync::Arc;

use mrol_client::ConnectionUse;
use mrol_map::sync::{Mutex, Rank};

use super::line::{Line, Place};

/// Another node: where it is, and the connections to it.
#[derive(Debug)]
pub(super) struct Peer {
    /// Address of its gRPC listener.
    pub(super) address: String,
    /// Of calls that are answered once.
    pub(super) calls: Line,
    /// Of watches, which keep their places: each has room for many, and there are as many as are needed.
    watches: Mutex<Vec<Arc<Line>>>,
}

impl Peer {
    pub(super) fn at(address: String) -> Self {
        Self { address, calls: Line::of(ConnectionUse::Calls), watches: Mutex::new(Rank::Brief, Vec::new()) }
    }

    /// A connection for a watch, with the place on it.
    pub(super) fn for_watch(&self) -> Option<(Arc<Line>, Place)> {
        let mut lines = self.watches.lock();
        lines.retain(|line| !line.is_unused());
        if let Some(found) = lines.iter().find_map(|line| Some((Arc::clone(line), line.free_place()?))) {
            return Some(found);
        }
        let line = Arc::new(Line::of(ConnectionUse::Watches));
        let place = line.free_place()?;
        lines.push(Arc::clone(&line));
        Some((line, place))
    }
}

#[cfg(test)]
mod tests {
    use super::super::line::CALLS_MAX;
    use super::*;

    #[test]
    fn watches_take_connections_as_they_need_them_and_none_of_those_of_calls() {
        let peer = Peer::at("http://127.0.0.1:1".to_owned());
        let held: Vec<_> = (0..2 * CALLS_MAX + 1).map(|_| peer.for_watch().unwrap()).collect();
        assert!(peer.calls.is_unused());
        assert_eq!(peer.watches.lock().len(), 3);
        assert!(Arc::ptr_eq(&held[0].0, &held[1].0) && !Arc::ptr_eq(&held[0].0, &held[CALLS_MAX].0));
        drop(held);
        let _held = peer.for_watch().unwrap();
        assert_eq!(peer.watches.lock().len(), 1, "those that nobody needs are given up");
    }
}
