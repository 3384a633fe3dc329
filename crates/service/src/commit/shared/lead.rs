//! Taking the lead of a map over, and giving it to another node.

use crate::commit::stop::{Stop, no_quorum, not_leader};
use crate::commit::submission::Refusal;
use crate::commit::worker::Worker;
use crate::error::ServiceError;
use crate::replication::{Member, NodeName, NotOrdered};
use mrol_store::Record;

impl Worker {
    /// Takes over: claims the lead where the log names another, gives the log what only this node has, and makes
    /// changes from then on.
    pub(super) fn lead(&mut self, live: &[(NodeName, u64)]) -> Result<(), ServiceError> {
        match self.settle_pending() {
            Err(Refusal::Failed(error)) => return Err(error),
            Ok(()) | Err(Refusal::Stale) => self.catch_up()?,
        }
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
        let Some(member) = &mut self.member else { return Ok(()) };
        // Also where the log names this node: another process of its name may have claimed, or this one before it was
        // started again.
        if !member.leads() {
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
            let given = member.head();
            if ordered.is_ok() {
                member.note_agreed(given);
            }
            self.settled(ordered)?;
            if given == head {
                return Err(no_quorum(&self.name, "it has what is given back, and not as a change"));
            }
        }
        Ok(())
    }

    pub(super) fn hand_over(&mut self, node: NodeName) -> Result<(), ServiceError> {
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
}
