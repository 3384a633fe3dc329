//! What nodes that serve the same maps share, kept by NATS JetStream.
//!
//! Reading order of the rooms; none names a room of a later line:
//!
//! 1. `engine`: the connection to NATS, and what is asked over it.

mod engine;

pub use engine::{ConnectError, Credentials, Engine, EngineSettings};
