//! A log in memory that never fails.

use std::sync::{Arc, Mutex};

use mrol::service::replication::{Base, Entry, LogError, Message, NotPublished, Position, ReplicatedLog};

/// A log that the nodes of this process share. A clone is another handle on the same one.
#[derive(Debug, Clone, Default)]
pub(super) struct SharedLog(Arc<Mutex<Vec<Entry>>>);

impl ReplicatedLog for SharedLog {
    fn publish(&self, message: &Message, position: Position) -> Result<(), NotPublished> {
        let mut entries = self.0.lock().unwrap();
        let end = entries.last().map_or_else(Position::default, Entry::position);
        if end != position {
            return Err(NotPublished::Refused);
        }
        entries.push(Entry { sequence: position.sequence + 1, message: message.clone() });
        Ok(())
    }

    fn base(&self) -> Result<Base, LogError> {
        Ok(Base::default())
    }

    fn read_behind(&self, position: Position) -> Result<Vec<Entry>, LogError> {
        let entries = self.0.lock().unwrap();
        Ok(entries.iter().filter(|entry| entry.sequence > position.sequence).cloned().collect())
    }
}
