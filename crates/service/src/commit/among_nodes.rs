//! How the worker of a map that several nodes share makes changes: those that it orders itself where this node leads,
//! and those that the log has from the others.

use std::time::{Duration, Instant};

use super::stop::{Stop, no_quorum, not_acknowledged, not_kept, not_leader, not_shared};
use super::submission::{Refusal, SharedAct};
use super::worker::Worker;
use crate::error::ServiceError;
use crate::replication::{Base, LogError, Member, NodeName, NotOrdered, OrderedChanges};
use mrol_map::map::{Change, Committed};
use mrol_store::{ReceivedRecord, Record, StoredRecords, check_replayed, read_frames};

/// How often a node begins to read before it says that the log does not hold together: where it stands, then at the
/// base, and at the base again where that was moved meanwhile.
const BEGINS_MAX: usize = 3;

/// How long a turn makes what the log has before other changes and the sync have theirs.
const TURN_MAX: Duration = Duration::from_millis(500);

/// Compares what the log has with what this node made before.
struct OwnHistory {
    /// The node's own records, from `next` on; none where they are not kept.
    records: Option<StoredRecords>,
    next: u64,
}

impl Worker {
    /// Does what a node does about a map that several share. `Stale` where there is more to follow than one turn takes.
    pub(super) fn act(&mut self, act: SharedAct) -> Result<Committed, Refusal> {
        if let Some(stop) = self.stopped.get() {
            return Err(stop.refusal(&self.name).into());
        }
        if let SharedAct::Join { log, node, map } = act {
            // Whether or not the log answers: from now on no change passes it by.
            self.member = Some(Member::join(log, node, map));
            return self.follow();
        }
        let Some(member) = &self.member else { return Err(not_shared(&self.name).into()) };
        match act {
            SharedAct::Join { .. } => {}
            SharedAct::Follow { newest } if newest == Some(member.position().sequence) => {}
            SharedAct::Follow { .. } => return self.follow(),
            SharedAct::Lead(live) => self.lead(&live)?,
            SharedAct::HandOver(node) => self.hand_over(node)?,
            SharedAct::Base(told) => {
                self.catch_up()?;
                drop(told.send(self.base_here()));
            }
        }
        Ok(Committed::none(self.map.content_version()))
    }

    /// Makes what the log has, as much as a turn takes: others wait for the next one.
    fn follow(&mut self) -> Result<Committed, Refusal> {
        let until = Instant::now() + TURN_MAX;
        match self.catch_up_until(Some(until))? {
            true => Ok(Committed::none(self.map.content_version())),
            false => Err(Refusal::Stale),
        }
    }

    /// Refuses changes where another node makes them, before any work is done for them.
    pub(super) fn check_leads(&self) -> Result<(), Refusal> {
        match &self.member {
            Some(member) if !member.leads() => Err(not_leader(&self.name, member.other_leader()).into()),
            _ => Ok(()),
        }
    }

    /// That there is nothing to change holds for the newest revision alone: a leader that was overtaken does not know it.
    pub(super) fn confirm_unchanged(&mut self) -> Result<(), Refusal> {
        if self.member.is_none() {
            return Ok(());
        }
        let revision = self.map.revision();
        self.settle_pending()?;
        self.catch_up()?;
        self.check_leads()?;
        if self.map.revision() == revision { Ok(()) } else { Err(Refusal::Stale) }
    }

    /// Puts the first of these records behind all that is in the log and in this node's folder; returns how many.
    pub(super) fn order_among_nodes(&mut self, records: &[&Record]) -> Result<usize, Refusal> {
        self.settle_pending()?;
        self.check_leads()?;
        let state_before = self.map.state_hash();
        let Some(member) = &mut self.member else { return Ok(0) };
        let records = &records[..member.fitting(records)];
        match member.order(records, Some(state_before)) {
            Ok(()) => {
                member.note_agreed(member.head());
                // In the log it is for good: where this folder fails now, the other nodes have it.
                let name = self.name.clone();
                self.append(records).map_err(|error| not_kept(&name, &error))?;
                Ok(records.len())
            }
            Err(NotOrdered::NotLeader) => Err(not_leader(&self.name, member.other_leader()).into()),
            Err(NotOrdered::Unknown { reason, may_count }) => {
                self.is_log_silent = true;
                let unknown = if may_count { not_acknowledged } else { no_quorum };
                Err(unknown(&self.name, &reason).into())
            }
            // The log has what this node did not know of when the change was decided.
            Err(NotOrdered::Overtaken) => {
                self.catch_up()?;
                Err(Refusal::Stale)
            }
        }
    }

    /// Finds out what became of what was published before, and makes it where it is in the log. `Stale` where the map went
    /// on by it.
    fn settle_pending(&mut self) -> Result<(), Refusal> {
        if self.is_log_silent {
            return Err(no_quorum(&self.name, "it did not answer just now").into());
        }
        let Some(member) = self.member.as_mut().filter(|member| member.has_pending()) else { return Ok(()) };
        let revision = self.map.revision();
        match member.settle() {
            Ok(None) => return Ok(()),
            Ok(Some(changes)) => self.make_ordered(&changes, &mut OwnHistory { records: None, next: 0 })?,
            Err(NotOrdered::NotLeader | NotOrdered::Overtaken) => self.catch_up()?,
            Err(NotOrdered::Unknown { reason, .. }) => {
                self.is_log_silent = true;
                return Err(no_quorum(&self.name, &reason).into());
            }
        }
        if self.map.revision() == revision { Ok(()) } else { Err(Refusal::Stale) }
    }

    /// Makes all that the log has behind what was read of it.
    fn catch_up(&mut self) -> Result<(), ServiceError> {
        self.catch_up_until(None).map(drop)
    }

    /// Makes what the log has, until that time; true where that is all.
    fn catch_up_until(&mut self, until: Option<Instant>) -> Result<bool, ServiceError> {
        let mut own = OwnHistory { records: None, next: 0 };
        for _ in 0..BEGINS_MAX {
            match self.read_on(&mut own, until) {
                Err(Interrupted::ByLog(LogError::NoSuchPosition)) => {
                    own = OwnHistory { records: None, next: 0 };
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
                if let Some(changes) = read.flatten() {
                    self.make_ordered(&changes, own)?;
                }
            }
            if until.is_some_and(|until| Instant::now() >= until) {
                return Ok(false);
            }
        }
    }

    /// Compares where the log begins with what this node has.
    fn compare_base(&mut self) -> Result<(), ServiceError> {
        let Some(base) = self.member.as_ref().map(|member| member.base().clone()) else { return Ok(()) };
        let (own, revision) = (self.map.revision(), base.revision);
        if own < revision {
            return Err(self.diverged(format!("it is at revision {own}, and the log begins at {revision}")));
        }
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

    /// Where another node can begin to read the log, with a copy of this map.
    pub(super) fn base_here(&self) -> Option<Base> {
        let revision = self.map.revision();
        let member = self.member.as_ref().filter(|member| member.agrees())?;
        member.base_here(revision, self.map.state_hash(), self.checksum_at(revision))
    }

    /// Checksum of this node's own record of a revision, where it is kept.
    fn checksum_at(&self, revision: u64) -> Option<u32> {
        let (_, stored) = self.own_records(revision)?.next()?.ok()?;
        Some(Record::from(stored).checksum())
    }

    /// Makes changes that the log has; those that this node made before are compared with it.
    fn make_ordered(&mut self, changes: &OrderedChanges, own: &mut OwnHistory) -> Result<(), ServiceError> {
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
        Ok(())
    }

    /// Takes over: claims the lead where the log names another, gives the log what only this node has, and makes
    /// changes from then on.
    fn lead(&mut self, live: &[(NodeName, u64)]) -> Result<(), ServiceError> {
        self.catch_up()?;
        let revision = self.map.revision();
        if let Some((node, head)) = live.iter().find(|(_, head)| *head > revision) {
            let reason = format!("node {node} has revision {head}, this one {revision}");
            return Err(no_quorum(&self.name, &reason));
        }
        let Some(member) = &self.member else { return Ok(()) };
        let head = member.head();
        if !member.agrees() {
            return Err(self.cannot_tell(head));
        }
        if revision > head && self.checksum_at(head + 1).is_none() {
            let how = format!(
                "it is at revision {revision}, the log at {head}, and it no longer keeps what is between"
            );
            return Err(Stop::Diverged(how).refusal(&self.name));
        }
        self.settle_pending().map_err(|refusal| self.not_settled(refusal))?;
        let Some(member) = &mut self.member else { return Ok(()) };
        if !member.is_named() {
            let claimed = member.claim_for_itself();
            self.settled(claimed)?;
        }
        self.give_back()?;
        if let Some(member) = &mut self.member {
            member.open();
            tracing::info!(map = %self.name, epoch = member.epoch(), revision, "leads");
        }
        Ok(())
    }

    /// Publishes what this node has and the log lost.
    fn give_back(&mut self) -> Result<(), ServiceError> {
        while let Some(member) = &mut self.member
            && member.head() < self.map.revision()
        {
            let head = member.head();
            let kept = self.folder.as_ref().map(|folder| folder.records_from(head + 1));
            let mut records: Vec<Record> = Vec::new();
            for kept in kept.into_iter().flatten() {
                let (_, record) = kept.map_err(|error| no_quorum(&self.name, &error.to_string()))?;
                records.push(record.into());
                if member.fitting(&records.iter().collect::<Vec<_>>()) < records.len() {
                    break;
                }
            }
            let records: Vec<&Record> = records.iter().collect();
            if records.is_empty() {
                return Err(
                    self.diverged(format!("the log lost revision {}, which it no longer keeps", head + 1))
                );
            }
            let state = self.published.recent.hashes_at(head).map(|hashes| hashes.state);
            tracing::warn!(map = %self.name, from = head + 1, "the log lost changes that this node has: they are given back");
            let ordered = member.order(&records[..member.fitting(&records)], state);
            if ordered.is_ok() && member.head() > head {
                member.note_agreed(member.head());
            } else {
                return self.settled(ordered);
            }
        }
        Ok(())
    }

    fn hand_over(&mut self, node: NodeName) -> Result<(), ServiceError> {
        self.catch_up()?;
        let Some(member) = self.member.as_mut().filter(|member| member.leads()) else {
            return Err(not_leader(&self.name, self.member.as_ref().and_then(Member::other_leader)));
        };
        let claimed = member.claim(node);
        self.settled(claimed)
    }

    /// What to say of something that is not a caller's change: whoever wants it asks again.
    fn settled(&self, ordered: Result<(), NotOrdered>) -> Result<(), ServiceError> {
        let leader = self.member.as_ref().and_then(Member::other_leader);
        ordered.map_err(|not_ordered| match not_ordered {
            NotOrdered::NotLeader | NotOrdered::Overtaken => not_leader(&self.name, leader),
            NotOrdered::Unknown { reason, .. } => no_quorum(&self.name, &reason),
        })
    }

    fn not_settled(&self, refusal: Refusal) -> ServiceError {
        match refusal {
            Refusal::Failed(error) => error,
            Refusal::Stale => not_leader(&self.name, self.member.as_ref().and_then(Member::other_leader)),
        }
    }

    /// This node's own records from a revision on.
    fn own_records(&self, revision: u64) -> Option<StoredRecords> {
        Some(self.folder.as_ref()?.records_from(revision))
    }

    /// Nothing shows that the log's revision is of this node's history: it neither goes on nor takes over. Other nodes may.
    fn cannot_tell(&self, revision: u64) -> ServiceError {
        let own = self.map.revision();
        let how = format!(
            "it is at revision {own}, and does not know any more whether the log's {revision} is of its history"
        );
        Stop::Diverged(how).refusal(&self.name)
    }

    fn differs_at(&self, revision: u64) -> ServiceError {
        let own = self.map.revision();
        self.diverged(format!(
            "it is at revision {own}, of another history than the log's since {revision} or before"
        ))
    }

    /// From now on this node makes no more changes of the map.
    fn diverged(&self, how: String) -> ServiceError {
        tracing::error!(map = %self.name, how, "this node has another history than the log");
        self.stopped.get_or_init(|| Stop::Diverged(how)).refusal(&self.name)
    }
}

impl OwnHistory {
    /// The node's own record of a revision, where it is kept; the revisions that are asked for ascend.
    fn record_of(&mut self, revision: u64, worker: &Worker) -> Option<Record> {
        if self.records.is_none() || self.next != revision {
            self.records = Some(worker.own_records(revision)?);
        }
        self.next = revision + 1;
        let (_, stored) = self.records.as_mut()?.next()?.ok()?;
        Some(stored.into())
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
