//! What a node is made of.

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
    /// How it reaches NATS.
    pub engine: EngineSettings,
}
