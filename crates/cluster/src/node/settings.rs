//! What a node is made of.

use std::time::Duration;

use mrol_service::replication::NodeName;

use crate::engine::EngineSettings;

/// What a node is made of.
#[derive(Debug, Clone)]
pub struct NodeSettings {
    /// Its name, which no other node has.
    pub name: NodeName,
    /// Address of its HTTP listener as clients reach it: `http://HOST:PORT`.
    pub http: String,
    /// Address of its gRPC listener as other nodes and clients reach it, likewise.
    pub grpc: String,
    /// Version of the program.
    pub version: String,
    /// Version of the records that it writes and reads.
    pub record_version: u32,
    /// How many nodes hold a map that is made at this one; 0 where all do.
    pub copies: usize,
    /// How it reaches NATS.
    pub engine: EngineSettings,
    /// When it puts a new base for a map that it leads.
    pub bases: BaseLimits,
}

/// When a new base of a map is put, behind which the front of its log is cut off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BaseLimits {
    /// Bytes of the log behind the base before.
    pub bytes_max: u64,
    /// Messages likewise: each costs a NATS server 300 bytes of memory.
    pub messages_max: u64,
    /// How often it is looked.
    pub looked_every: Duration,
    /// How often it is looked for what nothing points to; what was there at two looks is deleted. Longer than putting a
    /// base may take.
    pub swept_every: Duration,
}

impl Default for BaseLimits {
    fn default() -> Self {
        Self {
            bytes_max: 256 << 20,
            messages_max: 100_000,
            looked_every: Duration::from_secs(30),
            swept_every: Duration::from_secs(3600),
        }
    }
}
