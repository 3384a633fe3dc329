//! Making what the log has: changes of other nodes, with the checks of a replay.

use std::time::{Duration, Instant};

use super::own_history::OwnHistory;
use crate::commit::stop::no_quorum;
use crate::commit::submission::Refusal;
use crate::commit::worker::Worker;
use crate::error::ServiceError;
use crate::replication::{LogError, Member, OrderedChanges};
use mrol_map::map::{Change, Committed};
use mrol_store::{ReceivedRecord, Record, check_replayed, read_frames};

/// How often a node begins to read before it says that the log does not hold together: where it stands, then at the
/// base, and at the base again where that was moved meanwhile.
const BEGINS_MAX: usize = 3;

/// How long a turn makes what the log has before other changes and the sync have theirs.
const TURN_MAX: Duration = Duration::from_millis(500);

impl Worker {
    /// Makes what the log has, as much as a turn takes: others wait for the next one.
    pub(super) fn follow(&mut self) -> Result<Committed, Refusal> {
        let until = Instant::now() + TURN_MAX;
        match self.catch_up_until(Some(until))? {
            true => Ok(Committed::none(self.map.content_version())),
            false => Err(Refusal::Stale),
        }
    }

    /// Makes all that the log has behind what was read of it.
    pub(super) fn catch_up(&mut self) -> Result<(), ServiceError> {
        self.catch_up_until(None).map(drop)
    }

    /// Makes what the log has, until that time; true where that is all.
    fn catch_up_until(&mut self, until: Option<Instant>) -> Result<bool, ServiceError> {
        let mut own = OwnHistory::default();
        for _ in 0..BEGINS_MAX {
            match self.read_on(&mut own, until) {
                Err(Interrupted::ByLog(LogError::NoSuchPosition)) => {
                    own = OwnHistory::default();
                    let begun = self.member.as_mut().map_or(Ok(()), Member::begin_again);
                    begun.map_err(|error| no_quorum(&self.name, &error.to_string()))?;
                    self.compare_base()?;
                }
                Err(Interrupted::ByLog(LogError::Unavailable(reason))) => {
                    return Err(no_quorum(&self.name, &reason));
                }
                Err(Interrupted::ByChange(error)) => return Err(error),
                Ok(is_all) => return Ok(is_all),
            }
        }
        Err(no_quorum(&self.name, "it does not hold together"))
    }

    fn read_on(&mut self, own: &mut OwnHistory, until: Option<Instant>) -> Result<bool, Interrupted> {
        loop {
            if let Some(stop) = self.stopped.get() {
                return Err(Interrupted::ByChange(stop.refusal(&self.name)));
            }
            let Some(member) = &self.member else { return Ok(true) };
            let entries = member.fetch()?;
            if entries.is_empty() {
                return Ok(true);
            }
            for entry in entries {
                let read = self.member.as_mut().map(|member| member.read(entry)).transpose()?;
                let Some(changes) = read.flatten() else { continue };
                if let Err(error) = self.make_ordered(&changes, own) {
                    if let Some(member) = &mut self.member {
                        member.lose_place();
                    }
                    return Err(error.into());
                }
            }
            if until.is_some_and(|until| Instant::now() >= until) {
                return Ok(false);
            }
        }
    }

    /// Makes changes that the log has; those that this node made before are compared with it.
    pub(super) fn make_ordered(
        &mut self,
        changes: &OrderedChanges,
        own: &mut OwnHistory,
    ) -> Result<(), ServiceError> {
        let head = self.map.revision();
        if changes.first > head + 1 {
            let how = format!("it is at revision {head}, and the log begins at {}", changes.first);
            return Err(self.diverged(how));
        }
        let of_map = self.member.as_ref().map(Member::map).unwrap_or_default();
        let received = match read_frames(&changes.frames, changes.first, of_map) {
            Ok(received) if received.last().is_some_and(|it| it.revision == changes.last) => received,
            Ok(_) => return Err(self.diverged(format!("the log lacks records up to {}", changes.last))),
            Err(reason) => return Err(self.diverged(format!("the log has a message that is none: {reason}"))),
        };
        let before = self.published.recent.hashes_at(changes.first - 1).map(|hashes| hashes.state);
        let by_state = before.zip(changes.state_before).map(|(ours, theirs)| ours == theirs);
        let agreed_before = self.member.as_ref().is_some_and(|member| member.agrees_at(changes.first - 1));
        if by_state == Some(false) {
            return Err(self.differs_at(changes.first - 1));
        }
        let mut is_same = by_state == Some(true) || agreed_before;
        for ReceivedRecord { revision, record, change } in received {
            if revision > head {
                if !is_same {
                    return Err(self.cannot_tell(revision - 1));
                }
                self.make_received(revision, &record, change)?;
                continue;
            }
            match own.record_of(revision, self) {
                Some(ours) if ours != record => return Err(self.differs_at(revision)),
                ours => is_same = ours.is_some(),
            }
        }
        if let Some(member) = self.member.as_mut().filter(|_| is_same) {
            member.note_agreed(changes.last);
        }
        self.note_durable();
        Ok(())
    }

    /// Makes a change that another node ordered: what cannot be made does not come into the folder.
    fn make_received(&mut self, revision: u64, record: &Record, change: Change) -> Result<(), ServiceError> {
        if let Err(reason) = check_replayed(&self.map, &change) {
            return Err(self.diverged(format!("the log's revision {revision} cannot be made: {reason}")));
        }
        self.append(&[record])?;
        self.apply(change, |_| {});
        self.received = revision;
        Ok(())
    }
}

/// Why reading the log ended early.
enum Interrupted {
    ByLog(LogError),
    ByChange(ServiceError),
}

impl From<LogError> for Interrupted {
    fn from(error: LogError) -> Self {
        Self::ByLog(error)
    }
}

impl From<ServiceError> for Interrupted {
    fn from(error: ServiceError) -> Self {
        Self::ByChange(error)
    }
}
