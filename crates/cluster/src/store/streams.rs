//! On which NATS servers a cluster's streams are kept.

use uuid::Uuid;

use super::opening::{ClusterStore, STREAMS};
use crate::engine::{StreamError, StreamServers};
use crate::jetstream_log::JetStreamLog;

/// A stream, with the servers that keep it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StreamCopies {
    /// Its name at NATS.
    pub stream: String,
    /// The map whose log it is; none of a stream that all maps share.
    pub map: Option<Uuid>,
    /// The servers that keep it, or why that is not known.
    pub servers: Result<StreamServers, StreamError>,
}

impl ClusterStore {
    /// The streams that all maps share, and the logs of these maps, with the servers that keep each. Not for an async
    /// thread.
    pub fn stream_copies(&self, maps: impl IntoIterator<Item = Uuid>) -> Vec<StreamCopies> {
        let shared = STREAMS.into_iter().map(|stream| (stream.to_owned(), None));
        let logs = maps.into_iter().map(|map| (JetStreamLog::stream_of(map), Some(map)));
        let copies = |(stream, map): (String, Option<Uuid>)| {
            let servers = self.engine.block_on(self.engine.stream_servers(&stream));
            StreamCopies { stream, map, servers }
        };
        shared.chain(logs).map(copies).collect()
    }
}
