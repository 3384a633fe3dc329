//! Commits: how a change is planned, and carried out under the locks of what it touches.
//!
//! `committer` begins, plans and publishes; `shard_update` is its part in one shard, `level_update` in one level of
//! that.

mod block_change;
mod bulk;
mod committer;
mod level_moves;
mod level_update;
mod shard_update;

pub use committer::{Committer, ViewpointChange};
