//! What nodes that serve the same maps share, kept by NATS JetStream.
//!
//! Reading order of the rooms; none names a room of a later line:
//!
//! 1. `engine`: the connection to NATS, and what is asked over it.
//! 2. `jetstream_log`: the log of a map, which is a stream.
//! 3. `bucket`: values by key; `beat`, `beats`: what each node says of itself every two seconds, in one.
//! 4. `liveness`: who is gone, by the beats of all.
//! 5. `bases`: map files that stand for what is cut from the front of a log.

mod bases;
mod beat;
mod beats;
mod bucket;
mod engine;
mod jetstream_log;
mod liveness;

pub use bases::{Base, BaseError, BasePointers, BaseStore, Orphans};
pub use beat::{Beat, MapHead};
pub use beats::{BEAT_EVERY, Beats, NodeBeat};
pub use bucket::{Bucket, BucketEntry, BucketError};
pub use engine::{ConnectError, Credentials, Engine, EngineSettings, StreamError};
pub use jetstream_log::{FRAMES_MAX, JetStreamLog, News};
pub use liveness::Liveness;
