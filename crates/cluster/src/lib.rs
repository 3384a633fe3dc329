//! What nodes that serve the same maps share, kept by NATS JetStream.
//!
//! Reading order of the rooms; none names a room of a later line:
//!
//! 1. `engine`: the connection to NATS, and what is asked over it.
//! 2. `jetstream_log`: the log of a map, which is a stream.

mod engine;
mod jetstream_log;

pub use engine::{ConnectError, Credentials, Engine, EngineSettings};
pub use jetstream_log::{FRAMES_MAX, JetStreamLog, News, StreamError};
