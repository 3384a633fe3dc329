//! One map on several nodes: a log orders its changes, and each node makes them in its own folder.
//!
//! Reading order: `node_name` is what a node is called; `message` is what the log holds; `reading` is what follows from
//! it; [`ReplicatedLog`] is what a log must do; `member` is a node's part in it.

mod log;
mod member;
#[cfg(test)]
mod memory_log;
mod message;
mod node_name;
mod reading;
#[cfg(test)]
mod rule;

pub use log::{LogError, NotPublished, ReplicatedLog};
pub(crate) use member::{Member, NotOrdered};
#[cfg(test)]
pub(crate) use memory_log::{Failures, MemoryLog, NodeLog};
pub use message::{Body, Changes, Entry, Message, Piece, Position};
pub use node_name::{BadNodeName, NodeName};
pub use reading::Base;
pub(crate) use reading::OrderedChanges;
#[cfg(test)]
pub(crate) use rule::Rule;
