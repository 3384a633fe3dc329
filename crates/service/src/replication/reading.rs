//! What follows from the messages of a log: every node that has read the same messages knows the same.

use bytes::{Bytes, BytesMut};
use uuid::Uuid;

use super::message::{Body, Changes, Entry, Piece, Position};
use super::node_name::NodeName;
use mrol_map::map::StateHash;
use mrol_store::RECORD_BYTES_MAX;

/// Where readers of a log begin: what is before it may be gone.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Base {
    /// The last message before it.
    pub position: Position,
    /// The epoch there.
    pub epoch: u64,
    /// Who led there.
    pub leader: Option<NodeName>,
    /// The map's revision there.
    pub revision: u64,
    /// Hash of all that a copy of the map may hold there; a node knows it that has kept the hashes of so old revisions.
    pub state: Option<StateHash>,
    /// Checksum of the record that made the revision; a node knows it that has kept so old records.
    pub checksum: Option<u32>,
}

/// What a node knows from the messages that it has read.
#[derive(Debug, Clone)]
pub(crate) struct Reading {
    pub(super) position: Position,
    pub(super) epoch: u64,
    pub(super) leader: Option<NodeName>,
    /// The id of the last claim, where it was read.
    pub(super) claim: Option<Uuid>,
    /// The revision of the last change in the log.
    pub(super) head: u64,
    /// Where it began.
    pub(super) base: Base,
    /// What is there of a change whose last piece is not.
    pieces: Option<Pieces>,
}

/// Changes that are whole, and in their place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct OrderedChanges {
    /// The revision of the first.
    pub(crate) first: u64,
    /// The revision of the last.
    pub(crate) last: u64,
    /// Hash of all that a copy of the map may hold before the first, where it is known.
    pub(crate) state_before: Option<StateHash>,
    /// Frames of the journal.
    pub(crate) frames: Bytes,
}

/// The log does not go on where a node has read it up to: it is another one, of an older copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Broken;

#[derive(Debug, Clone)]
struct Pieces {
    changes: Changes,
    frames: BytesMut,
}

impl Reading {
    /// That of a node which has read nothing behind `base`.
    pub(super) fn from(base: Base) -> Self {
        let Base { position, epoch, leader, revision, .. } = base.clone();
        Self { position, epoch, leader, claim: None, head: revision, base, pieces: None }
    }

    /// Where others can begin to read, with a map that is at the head; none in the middle of a change, of which they
    /// would not see the beginning.
    pub(super) fn base_here(&self, state: StateHash, checksum: Option<u32>) -> Option<Base> {
        self.pieces.is_none().then(|| Base {
            position: self.position,
            epoch: self.epoch,
            leader: self.leader.clone(),
            revision: self.head,
            state: Some(state),
            checksum,
        })
    }

    /// Reads the next message: the changes that are whole with it.
    ///
    /// # Errors
    /// Where it is not the next of the log that was read so far; nothing changes then.
    pub(super) fn read(&mut self, entry: Entry) -> Result<Option<OrderedChanges>, Broken> {
        let Position { sequence, id } = self.position;
        if entry.sequence != sequence + 1 || entry.message.after != id {
            return Err(Broken);
        }
        let position = entry.position();
        let epoch = entry.message.epoch;
        let whole = match entry.message.body {
            Body::Claim(_) if epoch != self.epoch + 1 => return Err(Broken),
            Body::Claim(leader) => {
                // What the one before began, nobody ends.
                (self.epoch, self.leader, self.pieces) = (epoch, Some(leader), None);
                self.claim = Some(entry.message.id);
                None
            }
            // Of a leader that did not know of the claim yet: all nodes leave it out.
            Body::Changes(_) if epoch != self.epoch => None,
            Body::Changes(changes) => self.join(changes),
        };
        self.position = position;
        Ok(whole)
    }

    /// Puts a piece behind those before it: the whole, once it is there.
    fn join(&mut self, next: Changes) -> Option<OrderedChanges> {
        if next.first != self.head + 1 || next.last < next.first {
            self.pieces = None;
            return None;
        }
        let mut pieces = match self.pieces.take() {
            _ if next.piece.index == 0 => Pieces { changes: next.clone(), frames: BytesMut::new() },
            Some(pieces) if pieces.goes_on_with(&next) => pieces,
            _ => return None,
        };
        // No node writes so much: it would take the memory of all.
        if pieces.frames.len() + next.frames.len() > RECORD_BYTES_MAX {
            return None;
        }
        pieces.frames.extend_from_slice(&next.frames);
        pieces.changes.piece = next.piece;
        if !next.piece.is_last() {
            self.pieces = Some(pieces);
            return None;
        }
        self.head = next.last;
        let Changes { first, last, state_before, .. } = pieces.changes;
        Some(OrderedChanges { first, last, state_before, frames: pieces.frames.freeze() })
    }
}

impl Pieces {
    fn goes_on_with(&self, next: &Changes) -> bool {
        let Piece { index, of } = self.changes.piece;
        (next.piece.index, next.piece.of) == (index + 1, of)
            && (next.first, next.last) == (self.changes.first, self.changes.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replication::message::Message;

    fn node(name: &str) -> NodeName {
        NodeName::new(name).unwrap()
    }

    /// What is read of messages that follow each other, each in its epoch.
    fn read(bodies: Vec<(u64, Body)>) -> (Reading, Vec<(u64, u64, Bytes)>) {
        let mut reading = Reading::from(Base::default());
        let mut whole = Vec::new();
        for (epoch, body) in bodies {
            let message = Message { id: Uuid::new_v4(), after: reading.position.id, epoch, body };
            let entry = Entry { sequence: reading.position.sequence + 1, message };
            let ordered = reading.read(entry).unwrap();
            whole.extend(ordered.map(|it| (it.first, it.last, it.frames)));
        }
        (reading, whole)
    }

    fn claim(epoch: u64, name: &str) -> (u64, Body) {
        (epoch, Body::Claim(node(name)))
    }

    fn piece(epoch: u64, revisions: [u64; 2], index: u32, of: u32) -> (u64, Body) {
        let frames = Bytes::from(format!("{}.{index} ", revisions[0]));
        let [first, last] = revisions;
        (
            epoch,
            Body::Changes(Changes { first, last, state_before: None, piece: Piece { index, of }, frames }),
        )
    }

    #[test]
    fn changes_are_whole_with_their_last_piece() {
        let (reading, whole) = read(vec![
            claim(1, "a"),
            piece(1, [1, 3], 0, 1),
            piece(1, [4, 4], 0, 3),
            piece(1, [4, 4], 1, 3),
            piece(1, [4, 4], 2, 3),
        ]);
        assert_eq!(whole, [(1, 3, Bytes::from("1.0 ")), (4, 4, Bytes::from("4.0 4.1 4.2 "))]);
        assert_eq!((reading.head, reading.epoch, reading.leader), (4, 1, Some(node("a"))));
    }

    #[test]
    fn a_claim_voids_what_is_not_whole_and_all_of_the_epoch_before() {
        let (reading, whole) = read(vec![
            claim(1, "a"),
            piece(1, [1, 1], 0, 2),
            claim(2, "b"),
            piece(1, [1, 1], 1, 2),
            piece(1, [1, 1], 0, 1),
            piece(2, [1, 1], 1, 2),
        ]);
        assert_eq!((reading.head, reading.epoch, whole), (0, 2, Vec::new()));
    }

    #[test]
    fn a_piece_that_does_not_go_on_and_changes_of_another_revision_are_void() {
        let (_, whole) = read(vec![
            claim(1, "a"),
            piece(1, [1, 1], 0, 3),
            piece(1, [1, 1], 2, 3),
            piece(1, [1, 1], 1, 3),
            piece(1, [3, 3], 0, 1),
            piece(1, [1, 1], 0, 1),
            piece(1, [1, 1], 0, 1),
        ]);
        assert_eq!(whole, [(1, 1, Bytes::from("1.0 "))]);
    }

    #[test]
    fn what_does_not_go_on_from_the_last_message_is_of_another_log() {
        let (mut reading, _) = read(vec![claim(1, "a")]);
        let (before, after) = (reading.position, reading.position.id);
        let mut try_to_read = |sequence, after, epoch| {
            let message = Message { id: Uuid::new_v4(), after, epoch, body: Body::Claim(node("b")) };
            let read = reading.read(Entry { sequence, message });
            assert_eq!(read.is_err(), reading.position == before);
            read
        };
        assert_eq!(try_to_read(3, after, 2), Err(Broken), "a gap");
        assert_eq!(try_to_read(2, Some(Uuid::new_v4()), 2), Err(Broken), "behind another message");
        assert_eq!(try_to_read(2, after, 3), Err(Broken), "of an epoch whose beginning is not there");
        assert_eq!(try_to_read(2, after, 2), Ok(None));
    }
}
