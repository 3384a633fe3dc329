//! What nodes that serve the same maps share, kept by NATS JetStream.
//!
//! Reading order of the rooms; none names a room of a later line:
//!
//! 1. `engine`: the connection to NATS, and what is asked over it.
//! 2. `bucket`: values by key; `beat`, `beats`: what each node says of itself every two seconds, in one.
//! 3. `liveness`: who is gone, by the beats of all.
//! 4. `bases`: map files that stand for what is cut from the front of a log.
//! 5. `jetstream_log`: the log of a map, which is a stream.
//! 6. `following`: what makes a node's copy of a map follow its log.
//! 7. `forwarder`: what takes changes on to the node that leads.
//! 8. `catalog`: the list of maps that all nodes share.
//! 9. `store`: all of these at NATS, as one thing; maps are entered there.
//! 10. `overview`: the cluster as it is seen by whoever is no node of it.
//! 11. `node`: a node of the cluster, which beats, keeps its copies of the maps and takes over those whose leader is
//!     gone.

mod bases;
mod beat;
mod beats;
mod bucket;
mod catalog;
mod engine;
mod following;
mod forwarder;
mod jetstream_log;
mod liveness;
mod node;
mod overview;
mod store;

pub use bases::{BaseError, BasePointers, BaseStore, Orphans};
pub use beat::{Beat, MapHead};
pub use beats::{BEAT_EVERY, Beats, NodeBeat};
pub use bucket::{Bucket, BucketEntry, BucketError};
pub use catalog::{Catalog, CatalogError, Hints, Holders, Listing, MapEntry, Placement};
pub use engine::{
    ConnectError, Credentials, Engine, EngineSettings, StreamError, StreamServers, StreamState,
};
pub use following::Following;
pub use forwarder::{Forwarder, ForwarderError, ForwarderSettings, NodeCertificate};
pub use jetstream_log::{FRAMES_MAX, JetStreamLog, News};
pub use liveness::Liveness;
pub use node::{BaseLimits, Node, NodeSettings, NodeStatus};
pub use overview::{MapCopy, Overview, OverviewError, OverviewReader, SeenMap, SeenNode};
pub use store::{ClusterStore, EnterError, NoStore, StreamCopies};
