//! A log in memory that fails in the ways in which an engine for such logs does.

use std::sync::Arc;

use parking_lot::Mutex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::log::{LogError, NotPublished, ReplicatedLog};
use super::message::{Entry, Message, Position};
use super::reading::Base;

/// What goes wrong, each in so many of a hundred calls.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Failures {
    /// What was published is in the log, and its acknowledgment is lost.
    pub(crate) lost_acknowledgment: u32,
    /// What was published is lost.
    pub(crate) lost_message: u32,
    /// What was published arrives later, unless the log went on meanwhile.
    pub(crate) late_message: u32,
    /// A reader is told of a part of what is there, or of nothing.
    pub(crate) late_reader: u32,
    /// Nothing is acknowledged or read.
    pub(crate) no_quorum: bool,
}

/// The log, and what is on its way to it.
#[derive(Debug)]
pub(crate) struct MemoryLog {
    entries: Vec<Entry>,
    base: Base,
    late: Vec<(Message, Position)>,
    failures: Failures,
    rng: ChaCha8Rng,
}

/// The log as a node reaches it.
#[derive(Debug, Clone)]
pub(crate) struct NodeLog(pub(crate) Arc<Mutex<MemoryLog>>);

impl MemoryLog {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            entries: Vec::new(),
            base: Base::default(),
            late: Vec::new(),
            failures: Failures::default(),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    pub(crate) fn set_failures(&mut self, failures: Failures) {
        self.failures = failures;
    }

    /// An older copy of the log is put back: so many of the newest messages are gone, and what was on its way.
    pub(crate) fn lose_newest(&mut self, messages: usize) {
        self.late.clear();
        let kept = self.entries.len().saturating_sub(messages);
        self.entries.truncate(kept);
    }

    /// Messages behind the base.
    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Readers begin at `base` from now on: what is before it is gone.
    pub(crate) fn cut(&mut self, base: Base) {
        self.entries.retain(|entry| entry.sequence > base.position.sequence);
        self.base = base;
    }

    pub(crate) fn base(&self) -> &Base {
        &self.base
    }

    /// The last message.
    pub(crate) fn end(&self) -> Position {
        self.entries.last().map_or(self.base.position, Entry::position)
    }

    /// The epoch of the last message.
    pub(crate) fn epoch(&self) -> u64 {
        self.entries.last().map_or(self.base.epoch, |entry| entry.message.epoch)
    }

    /// True where the message is behind `position` now.
    fn put(&mut self, message: &Message, position: Position) -> bool {
        if position == self.end() {
            self.entries.push(Entry { sequence: position.sequence + 1, message: message.clone() });
            return true;
        }
        // An engine may know it again, and acknowledge it twice.
        self.holds(message) && self.chance(50)
    }

    fn holds(&self, message: &Message) -> bool {
        self.entries.iter().any(|entry| entry.message.id == message.id)
    }

    fn chance(&mut self, percent: u32) -> bool {
        self.rng.random_range(0..100) < percent
    }

    /// Some of what is on its way arrives.
    fn arrive(&mut self) {
        for (message, position) in std::mem::take(&mut self.late) {
            match self.chance(30) {
                true => drop(self.put(&message, position)),
                false => self.late.push((message, position)),
            }
        }
    }
}

impl ReplicatedLog for NodeLog {
    fn publish(&self, message: &Message, position: Position) -> Result<(), NotPublished> {
        let mut log = self.0.lock();
        let failures = log.failures;
        let lost = |what: &str| Err(NotPublished::Unknown(what.to_owned()));
        if failures.no_quorum {
            return lost("no quorum");
        }
        log.arrive();
        if log.chance(failures.lost_message) {
            return lost("lost");
        }
        if log.chance(failures.late_message) {
            log.late.push((message.clone(), position));
            return lost("late");
        }
        let is_there = log.put(message, position);
        if log.chance(failures.lost_acknowledgment) {
            return lost("unacknowledged");
        }
        is_there.then_some(()).ok_or(NotPublished::Refused)
    }

    fn base(&self) -> Result<Base, LogError> {
        Ok(self.0.lock().base.clone())
    }

    fn read_behind(&self, position: Position) -> Result<Vec<Entry>, LogError> {
        let mut log = self.0.lock();
        if log.failures.no_quorum {
            return Err(LogError::Unavailable("no quorum".into()));
        }
        log.arrive();
        let is_there =
            position == log.base.position || log.entries.iter().any(|it| it.position() == position);
        if !is_there {
            return Err(LogError::NoSuchPosition);
        }
        let behind: Vec<_> =
            log.entries.iter().filter(|entry| entry.sequence > position.sequence).cloned().collect();
        let late_reader = log.failures.late_reader;
        let told =
            if log.chance(late_reader) { log.rng.random_range(0..=behind.len()) } else { behind.len() };
        Ok(behind.into_iter().take(told).collect())
    }
}
