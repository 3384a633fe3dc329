//! Writers of a log.

use bytes::Bytes;
use mrol_cluster::JetStreamLog;
use mrol_map::map::StateHash;
use mrol_service::replication::{
    Body, Changes, Entry, LogError, Message, NodeName, NotPublished, Piece, Position, ReplicatedLog,
};
use uuid::Uuid;

/// A writer that knows where the log ends.
pub(crate) struct Writer<'a> {
    /// What it writes.
    pub(crate) log: &'a JetStreamLog,
    /// Behind which message.
    pub(crate) position: Position,
    /// What was acknowledged.
    pub(crate) written: Vec<Entry>,
}

impl<'a> Writer<'a> {
    /// One that begins before the first message.
    pub(crate) fn new(log: &'a JetStreamLog) -> Self {
        Self { log, position: Position::default(), written: Vec::new() }
    }

    /// Publishes changes with so many bytes of frames.
    pub(crate) fn write(&mut self, bytes: usize) -> Result<(), NotPublished> {
        let message = changes(self.position, bytes);
        self.publish(&message)
    }

    /// Publishes a message behind the writer's position.
    pub(crate) fn publish(&mut self, message: &Message) -> Result<(), NotPublished> {
        self.log.publish(message, self.position)?;
        let entry = Entry { sequence: self.position.sequence + 1, message: message.clone() };
        self.position = entry.position();
        self.written.push(entry);
        Ok(())
    }

    /// Publishes until it is acknowledged, which others may delay but not prevent.
    pub(crate) fn publish_at_last(&mut self, message: &Message) {
        super::eventually(|| match self.publish(message) {
            Err(NotPublished::Refused) => panic!("refused"),
            published => published,
        });
    }
}

/// Changes behind a position, with so many bytes of frames.
pub(crate) fn changes(position: Position, bytes: usize) -> Message {
    let first = position.sequence + 1;
    let frames = Bytes::from(vec![first as u8; bytes]);
    let state_before = Some(StateHash::from_bits(first));
    let changes = Changes { first, last: first, state_before, piece: Piece::WHOLE, frames };
    Message { id: Uuid::new_v4(), after: position.id, epoch: 1, body: Body::Changes(changes) }
}

/// A claim behind a position.
pub(crate) fn claim(position: Position, node: &str) -> Message {
    let body = Body::Claim(NodeName::new(node).unwrap());
    Message { id: Uuid::new_v4(), after: position.id, epoch: 1, body }
}

/// All of a log, read in batches; how many there were.
pub(crate) fn read_all(log: &JetStreamLog) -> (Vec<Entry>, usize) {
    read_all_behind(log, Position::default())
}

/// All of a log behind a position.
pub(crate) fn read_all_behind(log: &JetStreamLog, mut position: Position) -> (Vec<Entry>, usize) {
    let (mut all, mut batches) = (Vec::new(), 0);
    loop {
        let entries = super::eventually(|| match log.read_behind(position) {
            Err(LogError::NoSuchPosition) => panic!("no such position"),
            read => read,
        });
        let Some(last) = entries.last() else { return (all, batches) };
        position = last.position();
        all.extend(entries);
        batches += 1;
    }
}
