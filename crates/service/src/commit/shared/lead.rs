//! Taking the lead of a map over, and giving it to another node.

use crate::commit::stop::{Stop, no_quorum, not_leader};
use crate::commit::submission::Refusal;
use crate::commit::worker::Worker;
use crate::error::ServiceError;
use crate::replication::{Member, NodeName, NotOrdered};
use mrol_store::Record;
use uuid::Uuid;

impl Worker {
    /// Claims to lead. Whoever chose that it does may not have known of the last claims: where the log names another
    /// node in an epoch after `epoch`, that one leads.
    pub(super) fn claim(&mut self, epoch: Option<u64>) -> Result<(), ServiceError> {
        self.settle_and_catch_up()?;
        let revision = self.map.revision();
        let Some(member) = &self.member else { return Ok(()) };
        if let Some(leader) = member.other_leader().filter(|_| epoch.is_some_and(|it| it < member.epoch())) {
            return Err(not_leader(&self.name, Some(leader)));
        }
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
        if !member.leads() && !member.has_claimed() {
            let claimed = member.claim_for_itself();
            self.settled(claimed)?;
            if let Some(member) = &self.member {
                tracing::info!(map = %self.name, epoch = member.epoch(), revision, "claims to lead");
            }
        }
        Ok(())
    }

    /// Takes over by its claim of this id: gives the log what only this node has, and makes changes from then on. The
    /// `live` nodes have said how far they are after they had read the claim. A claim alone does not tell: where the
    /// log lost its newest messages, what it has is no measure of what another node made.
    pub(super) fn open(&mut self, claim: Option<Uuid>, live: &[(NodeName, u64)]) -> Result<(), ServiceError> {
        self.settle_and_catch_up()?;
        let revision = self.map.revision();
        let Some(member) = &self.member else { return Ok(()) };
        if member.leads() {
            return Ok(());
        }
        if !member.has_claimed() || member.last_claim() != claim {
            return Err(not_leader(&self.name, member.other_leader()));
        }
        if let Some((node, head)) = live.iter().find(|(_, head)| *head > revision) {
            let reason = format!("node {node} has revision {head}, this one {revision}");
            return Err(no_quorum(&self.name, &reason));
        }
        if !member.agrees() {
            return Err(self.cannot_tell(member.head()));
        }
        // A copy that is further may have been made the base since this node began: what it has was acknowledged.
        let base = member.base_now().map_err(|error| no_quorum(&self.name, &error.to_string()))?;
        self.check_has(base.revision)?;
        self.give_back()?;
        if let Some(member) = &mut self.member {
            member.open();
            tracing::info!(map = %self.name, epoch = member.epoch(), revision, "leads");
        }
        Ok(())
    }

    fn settle_and_catch_up(&mut self) -> Result<(), ServiceError> {
        match self.settle_pending() {
            Err(Refusal::Failed(error)) => Err(error),
            Ok(()) | Err(Refusal::Stale) => self.catch_up(),
        }
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

    /// Gives the lead to another node, or what it claimed to lead.
    pub(super) fn hand_over(&mut self, node: NodeName) -> Result<(), ServiceError> {
        self.catch_up()?;
        let Some(member) = self.member.as_mut().filter(|member| member.leads() || member.has_claimed())
        else {
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
