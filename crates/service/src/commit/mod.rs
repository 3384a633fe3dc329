//! How changes become durable, then visible, then acknowledged.
//!
//! ```text
//! many threads                one thread at a time
//!
//! align, quantize, encode --> take those that wait, in turns of callers, then of robots
//!                             append to the journal   they take their revisions here
//!                             sync                    once for all of them
//!                             apply                   in the order of revisions
//!                             publish, acknowledge
//! ```
//!
//! Of a map that several nodes share, the log that they share takes the place of the sync: `shared` puts a group
//! into it, and makes what the other nodes put there. `histories` tries that on logs that fail.
//!
//! A change whose content follows from the map (which voxels are there to be deleted) is decided when everything
//! before it is applied and nothing after it has begun.
//!
//! A [`Submission`] goes into the [`CommitQueue`] of its map, where `turns` orders it; one of the [`CommitThreads`],
//! which all maps share, takes it out, and the map's `worker` journals it, applies it and publishes it to
//! [`RecentChanges`]. `scan_turn` says what a scan that was prepared before may still do when its turn comes.

mod commit_queue;
mod commit_threads;
#[cfg(test)]
mod histories;
mod lead;
mod recent_changes;
mod scan_turn;
mod shared;
mod stop;
mod submission;
mod turns;
mod watched_change;
mod worker;

pub(crate) use commit_queue::CommitQueue;
pub(crate) use commit_threads::CommitThreads;
pub use lead::Lead;
pub(crate) use recent_changes::{RecentChanges, WatchedLevel};
pub(crate) use scan_turn::TurnLimits;
pub(crate) use stop::{Stop, not_leader};
pub(crate) use submission::{Decided, Prepared, Refusal, RobotLock, SharedAct, Step, Submission, record_of};
pub(crate) use watched_change::{BLOCKS_PER_PART, ChangeParts, Watched, WatchedChange, has_looked_into};
pub(crate) use worker::Published;
