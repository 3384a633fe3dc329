//! Putting changes of this node into the log, where it leads.

use super::own_history::OwnHistory;
use crate::commit::lead::Lead;
use crate::commit::stop::{no_quorum, not_acknowledged, not_joined, not_kept, not_leader};
use crate::commit::submission::Refusal;
use crate::commit::worker::Worker;
use crate::replication::NotOrdered;
use mrol_store::Record;

impl Worker {
    /// Refuses changes where another node makes them, before any work is done for them.
    pub(in crate::commit) fn check_leads(&self) -> Result<(), Refusal> {
        match &self.member {
            Some(member) if !member.leads() => Err(not_leader(&self.name, member.other_leader()).into()),
            None if *self.published.lead.borrow() == Lead::NotJoined => Err(not_joined(&self.name).into()),
            _ => Ok(()),
        }
    }

    /// That there is nothing to change holds for the newest revision alone: a leader that was overtaken does not know
    /// it.
    pub(in crate::commit) fn confirm_unchanged(&mut self) -> Result<(), Refusal> {
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
    pub(in crate::commit) fn order_among_nodes(&mut self, records: &[&Record]) -> Result<usize, Refusal> {
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

    /// Finds out what became of what was published before, and makes it where it is in the log. `Stale` where the map
    /// went on by it.
    pub(super) fn settle_pending(&mut self) -> Result<(), Refusal> {
        if self.is_log_silent {
            return Err(no_quorum(&self.name, "it did not answer just now").into());
        }
        let Some(member) = self.member.as_mut().filter(|member| member.has_pending()) else { return Ok(()) };
        let revision = self.map.revision();
        match member.settle() {
            Ok(None) => return Ok(()),
            Ok(Some(changes)) => self.make_ordered(&changes, &mut OwnHistory::default())?,
            Err(NotOrdered::NotLeader | NotOrdered::Overtaken) => self.catch_up()?,
            Err(NotOrdered::Unknown { reason, .. }) => {
                self.is_log_silent = true;
                return Err(no_quorum(&self.name, &reason).into());
            }
        }
        if self.map.revision() == revision { Ok(()) } else { Err(Refusal::Stale) }
    }
}
