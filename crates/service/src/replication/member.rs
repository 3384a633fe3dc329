//! A node's part in the log of a map: what it has read, and what it publishes.

use std::sync::Arc;

use bytes::Bytes;
use uuid::Uuid;

use super::log::{LogError, NotPublished, ReplicatedLog};
use super::message::{Body, Changes, Entry, Message, Piece, Position};
use super::node_name::NodeName;
use super::reading::{Base, OrderedChanges, Reading};
#[cfg(test)]
use super::rule::Rule;
use mrol_map::map::StateHash;
use mrol_store::{Record, frames_of};

/// Bytes of frames in a message, at most: with its headers it stays below the megabyte that an engine takes by default.
const PIECE_BYTES_MAX: usize = 768 << 10;
/// How often a message is published before its outcome is told as unknown. An attempt takes half a second where nobody
/// answers.
const ATTEMPTS: usize = 4;

/// A node's part in the log of a map.
#[derive(Debug)]
pub(crate) struct Member {
    node: NodeName,
    map: Uuid,
    log: Arc<dyn ReplicatedLog>,
    reading: Reading,
    /// False before it knows where the log begins.
    has_begun: bool,
    /// The id of the last claim that it made for itself, since it joined.
    own_claim: Option<Uuid>,
    /// The epoch in which this node makes changes; none before it took over.
    opened: Option<u64>,
    /// The last revision of the log that is known to be the same in this node's folder.
    agreed: Option<u64>,
    /// What it published last, and where, as long as it is not known what became of it.
    pending: Option<(Message, Position)>,
    /// Bytes of frames in a message, at most.
    piece_bytes_max: usize,
    #[cfg(test)]
    left_out: Option<Rule>,
}

/// Why something was not put into the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NotOrdered {
    /// Another node leads, or none does.
    NotLeader,
    /// Something else is there, or the log went back: read on, and decide again.
    Overtaken,
    /// It was not acknowledged in time.
    Unknown {
        /// What was seen instead.
        reason: String,
        /// False where what is there of it, if anything, is void.
        may_count: bool,
    },
}

impl Member {
    /// The part of `node` in the log of the map `map`, of which it has read nothing: not even where it begins.
    pub(crate) fn join(log: Arc<dyn ReplicatedLog>, node: NodeName, map: Uuid) -> Self {
        Self {
            node,
            map,
            log,
            reading: Reading::from(Base::default()),
            has_begun: false,
            own_claim: None,
            opened: None,
            agreed: None,
            pending: None,
            piece_bytes_max: PIECE_BYTES_MAX,
            #[cfg(test)]
            left_out: None,
        }
    }

    /// The node that leads, as far as the log was read.
    pub(crate) fn leader(&self) -> Option<&NodeName> {
        self.reading.leader.as_ref()
    }

    /// The node that leads in the place of this one, as far as the log was read.
    pub(crate) fn other_leader(&self) -> Option<&NodeName> {
        self.leader().filter(|leader| **leader != self.node)
    }

    /// Up to where the log was read.
    pub(crate) fn position(&self) -> Position {
        self.reading.position
    }

    /// The epoch, as far as the log was read.
    pub(crate) fn epoch(&self) -> u64 {
        self.reading.epoch
    }

    /// The revision of the last change that was read.
    pub(crate) fn head(&self) -> u64 {
        self.reading.head
    }

    /// Where it began to read.
    pub(crate) fn base(&self) -> &Base {
        &self.reading.base
    }

    /// Where readers of the log begin now.
    ///
    /// # Errors
    /// Where that cannot be found out.
    pub(crate) fn base_now(&self) -> Result<Base, LogError> {
        self.log.base()
    }

    /// Where others can begin to read, with a copy of this node's map at `revision`, of which all that a copy may hold
    /// has the hash `state`, made by a record with the checksum; none where that would be in the middle of a change, or
    /// where the log is not at this revision.
    pub(crate) fn base_here(&self, revision: u64, state: StateHash, checksum: Option<u32>) -> Option<Base> {
        self.reading.base_here(state, checksum).filter(|base| base.revision == revision)
    }

    /// The map that the log is of.
    pub(crate) fn map(&self) -> Uuid {
        self.map
    }

    /// True where the log names this node as the one that leads.
    pub(crate) fn is_named(&self) -> bool {
        self.leader() == Some(&self.node)
    }

    /// The id of the last claim, where this node has read it.
    pub(crate) fn last_claim(&self) -> Option<Uuid> {
        self.reading.claim
    }

    /// True where this node claimed last, and since it joined: an earlier process of its name, or one beside it, may
    /// have claimed as well.
    pub(crate) fn has_claimed(&self) -> bool {
        self.reading.claim.is_some() && self.reading.claim == self.own_claim
    }

    /// True where this node makes the map's changes: the log names it, and it took over.
    pub(crate) fn leads(&self) -> bool {
        self.opened.is_some() && self.opened == self.own_epoch()
    }

    /// The epoch, where it names this node.
    fn own_epoch(&self) -> Option<u64> {
        #[cfg(test)]
        if let (Some(Rule::OwnEpoch), Some(epoch)) = (self.left_out, self.opened) {
            return Some(epoch);
        }
        Some(self.epoch()).filter(|_| self.is_named())
    }

    /// From now on this node makes changes, in the present epoch.
    pub(crate) fn open(&mut self) {
        self.opened = Some(self.epoch());
    }

    /// The messages behind what was read.
    ///
    /// # Errors
    /// As for [`ReplicatedLog::read_behind`]; `NoSuchPosition` before it has begun.
    pub(crate) fn fetch(&self) -> Result<Vec<Entry>, LogError> {
        if !self.has_begun {
            return Err(LogError::NoSuchPosition);
        }
        self.log.read_behind(self.reading.position)
    }

    /// Reads the next message: the changes that are whole with it.
    ///
    /// # Errors
    /// `NoSuchPosition` where it does not go on from what was read.
    pub(crate) fn read(&mut self, entry: Entry) -> Result<Option<OrderedChanges>, LogError> {
        let whole = self.reading.read(entry).map_err(|_| LogError::NoSuchPosition)?;
        // Something is at its place: itself, or what keeps it out for good.
        self.pending = None;
        Ok(whole)
    }

    /// Begins at the log's base, and forgets what was read before.
    ///
    /// # Errors
    /// Where the log does not say where it begins.
    pub(crate) fn begin_again(&mut self) -> Result<(), LogError> {
        self.reading = Reading::from(self.log.base()?);
        self.has_begun = true;
        // What this node has and the log lost is given back before more comes behind it. Others may have read what it
        // published last and never heard of: a claim that is still there says nothing of that, so it claims again.
        (self.agreed, self.opened, self.own_claim, self.pending) = (None, None, None, None);
        Ok(())
    }

    /// Has the node begin at the log's base when it reads next: it did not make what it read last.
    pub(crate) fn lose_place(&mut self) {
        (self.has_begun, self.opened) = (false, None);
    }

    /// Notes that the log's revision and this node's are the same.
    pub(crate) fn note_agreed(&mut self, revision: u64) {
        self.agreed = Some(revision);
    }

    /// True where all that the log has is known to be what this node has: it is, or the log has nothing.
    pub(crate) fn agrees(&self) -> bool {
        self.head() == 0 || self.agreed == Some(self.head())
    }

    /// True where revision `revision` of the log is known to be what this node has.
    pub(crate) fn agrees_at(&self, revision: u64) -> bool {
        revision == 0 || self.agreed == Some(revision)
    }

    /// True where it is not known yet what became of what it published last.
    pub(crate) fn has_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// How many of the first records one message takes: at least one, which may be cut into pieces.
    pub(crate) fn fitting(&self, records: &[&Record]) -> usize {
        let mut bytes = 0;
        let fits = |record: &&&Record| {
            bytes += record.frame_bytes();
            bytes <= self.piece_bytes_max
        };
        records.iter().take_while(fits).count().max(1).min(records.len())
    }

    /// Puts records, as many as fit, directly behind what was read: they make the next revisions. `state_before` is the
    /// hash of all that a copy of the map may hold before them, where it is known.
    ///
    /// # Errors
    /// Says what is known of them.
    pub(crate) fn order(
        &mut self,
        records: &[&Record],
        state_before: Option<StateHash>,
    ) -> Result<(), NotOrdered> {
        let epoch = self.own_epoch().ok_or(NotOrdered::NotLeader)?;
        let (first, last) = (self.head() + 1, self.head() + records.len() as u64);
        let mut frames = Bytes::from(frames_of(records, first, self.map));
        let of = frames.len().div_ceil(self.piece_bytes_max).max(1) as u32;
        for index in 0..of {
            let piece = Piece { index, of };
            let frames = frames.split_to(self.piece_bytes_max.min(frames.len()));
            let changes = Changes { first, last, state_before, piece, frames };
            match self.publish(epoch, Body::Changes(changes)) {
                Err(NotOrdered::Unknown { reason, .. }) => {
                    return Err(NotOrdered::Unknown { reason, may_count: piece.is_last() });
                }
                published => published?,
            }
        }
        Ok(())
    }

    /// Writes into the log, directly behind what was read, that `leader` leads from here on.
    ///
    /// # Errors
    /// Says what is known of it.
    pub(crate) fn claim(&mut self, leader: NodeName) -> Result<(), NotOrdered> {
        #[cfg(test)]
        self.skip_to_end_without(Rule::CaughtUp);
        self.publish(self.epoch() + 1, Body::Claim(leader))
    }

    /// The node itself leads from here on.
    ///
    /// # Errors
    /// As for [`Member::claim`].
    pub(crate) fn claim_for_itself(&mut self) -> Result<(), NotOrdered> {
        self.claim(self.node.clone())
    }

    /// Publishes the last message again, where its outcome is not known. Returns the changes that are whole with it.
    ///
    /// Nothing else is published at its place before. A follower may have read it there: if another message took its
    /// place, the two nodes would have different histories.
    ///
    /// # Errors
    /// Says what is known of it now.
    pub(crate) fn settle(&mut self) -> Result<Option<OrderedChanges>, NotOrdered> {
        match self.pending.take() {
            Some((message, position)) => self.send(message, position),
            None => Ok(None),
        }
    }

    /// Publishes a message directly behind what was read.
    fn publish(&mut self, epoch: u64, body: Body) -> Result<(), NotOrdered> {
        if self.has_pending() {
            let reason = "what was published before is still on its way".to_owned();
            return Err(NotOrdered::Unknown { reason, may_count: false });
        }
        #[cfg(test)]
        self.skip_to_end_without(Rule::Position);
        let position = self.reading.position;
        let message = Message { id: Uuid::new_v4(), after: position.id, epoch, body };
        // The caller has what was published, and makes it.
        self.send(message, position).map(drop)
    }

    /// Sends the same message until it is known what became of it.
    fn send(&mut self, message: Message, position: Position) -> Result<Option<OrderedChanges>, NotOrdered> {
        let mut reason = None;
        for _ in 0..ATTEMPTS {
            #[cfg(test)]
            let message = self.under_new_id(&message);
            let unknown = match self.log.publish(&message, position) {
                Ok(()) => return self.read_own(position, message.clone()),
                Err(NotPublished::Unknown(unknown)) => unknown,
                Err(refused @ NotPublished::Refused) => match self.log.read_behind(position) {
                    Ok(behind) => match behind.first() {
                        Some(entry) if entry.message.id == message.id => {
                            return self.read_own(position, message.clone());
                        }
                        Some(_) => return Err(NotOrdered::Overtaken),
                        // What was read is older than the refusal.
                        None => refused.to_string(),
                    },
                    // It may have been there, read by others, and lost with what was before it.
                    Err(lost @ LogError::NoSuchPosition) if reason.is_some() => {
                        return Err(NotOrdered::Unknown { reason: lost.to_string(), may_count: true });
                    }
                    Err(LogError::NoSuchPosition) => return Err(NotOrdered::Overtaken),
                    Err(LogError::Unavailable(unknown)) => unknown,
                },
            };
            reason = Some(unknown);
        }
        self.pending = Some((message, position));
        Err(NotOrdered::Unknown { reason: reason.unwrap_or_default(), may_count: true })
    }

    /// Reads what this node published itself, as all others do.
    fn read_own(
        &mut self,
        position: Position,
        message: Message,
    ) -> Result<Option<OrderedChanges>, NotOrdered> {
        let is_claim = matches!(message.body, Body::Claim(_));
        let entry = Entry { sequence: position.sequence + 1, message };
        let whole = self.reading.read(entry).map_err(|_| NotOrdered::Overtaken)?;
        if is_claim && self.is_named() {
            self.own_claim = self.reading.claim;
        }
        Ok(whole)
    }
}

/// Nodes that leave out a rule, in tests.
#[cfg(test)]
impl Member {
    pub(crate) fn without(self, rule: Option<Rule>) -> Self {
        Self { left_out: rule, ..self }
    }

    /// With smaller messages.
    pub(crate) fn with_pieces_of(self, piece_bytes_max: usize) -> Self {
        Self { piece_bytes_max, ..self }
    }

    /// Takes what it has not read for read.
    fn skip_to_end_without(&mut self, rule: Rule) {
        if self.left_out != Some(rule) {
            return;
        }
        while let Ok(entries) = self.fetch()
            && !entries.is_empty()
        {
            for entry in entries {
                drop(self.reading.read(entry));
            }
        }
    }

    fn under_new_id(&self, message: &Message) -> Message {
        let id = if self.left_out == Some(Rule::SameId) { Uuid::new_v4() } else { message.id };
        Message { id, ..message.clone() }
    }
}
