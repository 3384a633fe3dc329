//! All that the nodes of a cluster keep at NATS, as one thing.
//!
//! Reading order: `opening` is [`ClusterStore`], and why there is none; `entering` puts a new map there and takes one
//! away; `streams` says on which servers it is kept.

mod entering;
mod opening;
mod streams;

pub use entering::EnterError;
pub use opening::{ClusterStore, NoStore};
pub use streams::StreamCopies;
