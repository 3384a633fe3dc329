//! The trait of logs that nodes share.

use std::fmt::Debug;

use super::message::{Entry, Message, Position};
use super::reading::Base;

/// Why a message was not published, as far as is known.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotPublished {
    /// The log does not end at the position. Where this message is not directly behind it already, from an attempt
    /// before, it never will be.
    #[error("the log went on, or back, from there")]
    Refused,
    /// Nobody acknowledged it in time: it is in the log, will be, or will not.
    #[error("{0}")]
    Unknown(String),
}

/// Why a log could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LogError {
    /// The log does not have the message at that position any more, or has another there: an older copy was put back,
    /// or what was there is only in the base now. Whoever reads begins at the base again.
    #[error("the log has no such position")]
    NoSuchPosition,
    /// The log does not answer.
    #[error("{0}")]
    Unavailable(String),
}

/// The log that orders the changes of one map, the same for all nodes that hold the map.
///
/// A message that was acknowledged is on the disks of most of the machines that keep the log. The log may lose the
/// newest all the same, when a fault of its engine or an older copy put back takes them away: whoever shares it
/// compares positions by id.
///
/// All calls may wait, for a second at most, and are not for an async thread.
pub trait ReplicatedLog: Debug + Send + Sync {
    /// Publishes a message directly behind `position`, or not at all: by compare-and-set on the number *and* the id of
    /// the log's last message. Returns once it is acknowledged. A call that fails may be made again with the same
    /// message.
    ///
    /// # Errors
    /// Says whether the message may be in the log.
    fn publish(&self, message: &Message, position: Position) -> Result<(), NotPublished>;

    /// Where readers begin.
    ///
    /// # Errors
    /// Where that cannot be found out now.
    fn base(&self) -> Result<Base, LogError>;

    /// Reads the messages directly behind `position`, in order: at least one where there are any that this node's part
    /// of the log knows of, and some megabytes at most.
    ///
    /// A position that was just cut off is still one, where the first message that was kept names it.
    ///
    /// # Errors
    /// Says whether the position is none of this log any more.
    fn read_behind(&self, position: Position) -> Result<Vec<Entry>, LogError>;
}
