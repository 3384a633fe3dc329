//! What a node has made before, compared with what the log has.

use crate::commit::stop::Stop;
use crate::commit::worker::Worker;
use crate::error::ServiceError;
use crate::replication::Base;
use mrol_store::{Record, StoredRecords};

/// Compares what the log has with what this node made before.
#[derive(Default)]
pub(super) struct OwnHistory {
    /// The node's own records, from `next` on; none where they are not kept.
    records: Option<StoredRecords>,
    next: u64,
}

impl Worker {
    /// Compares where the log begins with what this node has.
    pub(super) fn compare_base(&mut self) -> Result<(), ServiceError> {
        let Some(base) = self.member.as_ref().map(|member| member.base().clone()) else { return Ok(()) };
        let revision = base.revision;
        self.check_has(revision)?;
        let state = self.published.recent.hashes_at(revision).map(|hashes| hashes.state);
        let by_state = state.zip(base.state).map(|(ours, theirs)| ours == theirs);
        let by_record = self.checksum_at(revision).zip(base.checksum).map(|(ours, theirs)| ours == theirs);
        match ([by_state, by_record], &mut self.member) {
            ([Some(false), _] | [_, Some(false)], _) => Err(self.differs_at(revision)),
            ([Some(true), _] | [_, Some(true)], Some(member)) => {
                member.note_agreed(revision);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Refuses where the log begins at a revision that this node has not made.
    pub(super) fn check_has(&self, revision: u64) -> Result<(), ServiceError> {
        let own = self.map.revision();
        if own >= revision {
            return Ok(());
        }
        let how = format!("it is at revision {own}, and the log begins at {revision}");
        tracing::warn!(map = %self.name, how, "this node's copy is behind where the log begins");
        Err(self.stopped.get_or_init(|| Stop::Behind(how)).refusal(&self.name))
    }

    /// Where another node can begin to read the log, with a copy of this map.
    pub(in crate::commit) fn base_here(&self) -> Option<Base> {
        let revision = self.map.revision();
        let member = self.member.as_ref().filter(|member| member.agrees())?;
        member.base_here(revision, self.map.state_hash(), self.checksum_at(revision))
    }

    /// Checksum of this node's own record of a revision, where it is kept.
    pub(super) fn checksum_at(&self, revision: u64) -> Option<u32> {
        let (_, stored) = self.own_records(revision)?.next()?.ok()?;
        Some(Record::from(stored).checksum())
    }

    /// This node's own records from a revision on.
    pub(super) fn own_records(&self, revision: u64) -> Option<StoredRecords> {
        Some(self.folder.as_ref()?.records_from(revision))
    }

    /// Nothing shows that the log's revision is of this node's history: it neither goes on nor takes over. Other nodes
    /// may.
    pub(super) fn cannot_tell(&self, revision: u64) -> ServiceError {
        let own = self.map.revision();
        let how = format!(
            "it is at revision {own}, and does not know any more whether the log's {revision} is of its history"
        );
        Stop::Diverged(how).refusal(&self.name)
    }

    pub(super) fn differs_at(&self, revision: u64) -> ServiceError {
        let own = self.map.revision();
        self.diverged(format!(
            "it is at revision {own}, of another history than the log's since {revision} or before"
        ))
    }

    /// From now on this node makes no more changes of the map.
    pub(super) fn diverged(&self, how: String) -> ServiceError {
        tracing::error!(map = %self.name, how, "this node has another history than the log");
        self.stopped.get_or_init(|| Stop::Diverged(how)).refusal(&self.name)
    }
}

impl OwnHistory {
    /// The node's own record of a revision, where it is kept; the revisions that are asked for ascend.
    pub(super) fn record_of(&mut self, revision: u64, worker: &Worker) -> Option<Record> {
        // Nothing is opened for each of thousands that are not kept.
        if worker.folder.as_ref()?.used().kept_from > revision {
            return None;
        }
        if self.records.is_none() || self.next != revision {
            self.records = Some(worker.own_records(revision)?);
        }
        self.next = revision + 1;
        match self.records.as_mut()?.next() {
            Some(Ok((there, stored))) if there == revision => Some(stored.into()),
            // It is not kept. The next one may be.
            _ => {
                self.records = None;
                None
            }
        }
    }
}
