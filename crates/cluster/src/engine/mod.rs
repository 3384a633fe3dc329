//! The connection to NATS, and requests over it.
//!
//! Reading order: `settings` is what a connection is made of; `connect_error` is why there is none; `connection` is
//! [`Engine`]; `request` is a question to it with a deadline; `api` is a question to JetStream, in JSON; `batch` is one
//! with several messages as its answer; `streams` makes and deletes streams; `opening` is how a connection begins.

mod api;
mod batch;
mod connect_error;
mod connection;
mod opening;
mod request;
mod settings;
mod streams;

pub(crate) use api::{ApiError, CallError, read_answer};
pub(crate) use batch::BatchMessage;
pub use connect_error::ConnectError;
pub use connection::Engine;
pub use settings::{Credentials, EngineSettings};
pub use streams::{StreamError, StreamServers, StreamState};
