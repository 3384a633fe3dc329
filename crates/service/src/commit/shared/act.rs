//! What a node does about a map that several share.

use crate::commit::stop::not_shared;
use crate::commit::submission::{Refusal, SharedAct};
use crate::commit::worker::Worker;
use crate::replication::Member;
use mrol_map::map::Committed;
use mrol_store::Snapshot;

impl Worker {
    /// Does what a node does about a map that several share. `Stale` where there is more to follow than one turn takes.
    pub(in crate::commit) fn act(&mut self, act: SharedAct) -> Result<Committed, Refusal> {
        if let Some(stop) = self.stopped.get() {
            return Err(stop.refusal(&self.name).into());
        }
        if let SharedAct::Join { log, node, map } = act {
            // Whether or not the log answers: from now on no change passes it by.
            self.member = Some(Member::join(log, node, map));
            return self.follow();
        }
        let Some(member) = &self.member else { return Err(not_shared(&self.name).into()) };
        let member_map = member.map();
        match act {
            SharedAct::Join { .. } => {}
            SharedAct::Follow { newest } if newest == Some(member.position().sequence) => {}
            SharedAct::Follow { .. } => return self.follow(),
            SharedAct::Claim { epoch } => self.claim(epoch)?,
            SharedAct::Open { claim, live } => self.open(claim, &live)?,
            SharedAct::HandOver(node) => self.hand_over(node)?,
            #[cfg(test)]
            SharedAct::Base(told) => {
                self.catch_up()?;
                drop(told.send(self.base_here()));
            }
            SharedAct::Copy(told) => {
                self.catch_up()?;
                let copy = self.base_here().map(|base| (base, Snapshot::of(&self.map, member_map)));
                drop(told.send(copy));
            }
        }
        Ok(Committed::none(self.map.content_version()))
    }
}
