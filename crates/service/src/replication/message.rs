//! What the log of a map holds: claims of nodes to lead it, and changes of the node that does.
//!
//! A log is a chain: each message names the one before it by its id. A sequence number alone does not say which log it
//! is a place in, once an older copy of the log was put back and went on from there.

use bytes::Bytes;
use uuid::Uuid;

use super::node_name::NodeName;
use mrol_map::map::StateHash;

/// A place in a log: the last message that was read, or where the log begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Position {
    /// Its number in the log: 1, 2, 3, ...; 0 before the first.
    pub sequence: u64,
    /// Its id; none before the first.
    pub id: Option<Uuid>,
}

/// A message of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Chosen by its writer, at random. A message that is sent again has the same id.
    pub id: Uuid,
    /// The id of the message before it; none of the first.
    pub after: Option<Uuid>,
    /// How many claims there were before it, itself counted. Changes are of the epoch in which they were made.
    pub epoch: u64,
    /// What it says.
    pub body: Body,
}

/// What a message says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Body {
    /// From here on this node leads the map.
    Claim(NodeName),
    /// Changes of the node that leads, or a piece of one.
    Changes(Changes),
}

/// Changes of consecutive revisions, or a piece of one that is too large for a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Changes {
    /// The revision of the first.
    pub first: u64,
    /// The revision of the last.
    pub last: u64,
    /// Hash of all that a copy of the map may hold before the first.
    pub state_before: StateHash,
    /// Which piece of how many this is; the changes are made once the last is there.
    pub piece: Piece,
    /// Frames of the journal, as `mrol_store` writes them; of a piece, its part of their bytes.
    pub frames: Bytes,
}

/// Which piece of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// From 0.
    pub index: u32,
    /// At least 1.
    pub of: u32,
}

/// A message with its number in the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// 1, 2, 3, ...
    pub sequence: u64,
    /// What was published.
    pub message: Message,
}

impl Piece {
    /// The only one.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// True of the last.
    pub fn is_last(self) -> bool {
        self.index + 1 == self.of
    }
}

impl Entry {
    /// The place of whoever has read it.
    pub fn position(&self) -> Position {
        Position { sequence: self.sequence, id: Some(self.message.id) }
    }
}
