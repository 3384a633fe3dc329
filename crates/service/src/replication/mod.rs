//! One map on several nodes: a log orders its changes, and each node makes them in its own folder.
//!
//! Reading order: `node_name` is what a node is called; `message` is what the log holds; [`ReplicatedLog`] is what a log
//! must do.

mod log;
mod message;
mod node_name;

pub use log::{LogError, NotPublished, ReplicatedLog};
pub use message::{Body, Changes, Entry, Message, Piece, Position};
pub use node_name::{BadNodeName, NodeName};
