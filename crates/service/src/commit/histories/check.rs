//! What must hold in a history, at each step and at its end.

use std::collections::BTreeSet;

use super::changes::marker;
use super::history::{Checked, History, Violation};
use super::node::{NODES, Node};
use crate::commit::submission::SharedAct;
use crate::replication::{Failures, Member};

impl History {
    /// Every node has at each of its revisions what the others have.
    pub(super) fn compare(&mut self) -> Checked {
        if self.is_double {
            return Ok(());
        }
        for Node { name, process, .. } in &mut self.nodes {
            let Some(process) = process else { continue };
            for revision in process.compared + 1..=process.map.revision() {
                let Some(hashes) = process.recent.hashes_at(revision) else { continue };
                if *self.states.entry(revision).or_insert(hashes.state) != hashes.state {
                    return Err(Violation(format!("{name} differs at revision {revision}")));
                }
            }
            process.compared = process.map.revision();
        }
        Ok(())
    }

    /// All failures end; the node that is furthest leads, and all catch up.
    pub(super) fn heal(mut self) -> Checked {
        self.log.lock().set_failures(Failures::default());
        (0..NODES).try_for_each(|node| self.start(node))?;
        for _ in 0..2 {
            for node in 0..NODES {
                self.act(node, SharedAct::Follow { newest: None })?;
                self.start(node)?;
            }
        }
        let revision = |node: &Node| node.process.as_ref().map_or(0, |process| process.map.revision());
        (0..NODES).try_for_each(|node| self.lead(node, 1.0))?;
        (0..NODES).try_for_each(|node| self.act(node, SharedAct::Follow { newest: None }))?;
        if self.is_double {
            return self.check_told();
        }
        self.compare()?;
        let last = self.nodes.iter().map(revision).max().unwrap_or_default();
        for node in &self.nodes {
            let Some(process) = &node.process else { continue };
            let view = process.map.view();
            let made =
                (0..self.next).filter(|&number| view.contains(marker(number), 0)).collect::<BTreeSet<_>>();
            drop(view);
            if let Some(missing) = self.acknowledged.difference(&made).next() {
                return Err(Violation(format!("{} lacks change {missing}", node.name)));
            }
            if let Some(refused) = self.refused.intersection(&made).next() {
                return Err(Violation(format!("{} made change {refused}, which was refused", node.name)));
            }
            let scans = process.map.trajectory().scans();
            if scans != made.len() as u64 || revision(node) != last {
                let (name, made) = (&node.name, made.len());
                let at = revision(node);
                return Err(Violation(format!(
                    "{name} made {made} changes in {scans} scans, at {at} of {last}"
                )));
            }
        }
        Ok(())
    }

    /// Nodes that have not said that their histories differ have the same at each revision. One may be behind for good:
    /// where the node that is further no longer keeps what the log lost, neither of the two takes over.
    pub(super) fn check_told(&mut self) -> Checked {
        for _ in 0..2 {
            (0..NODES).try_for_each(|node| self.lead(node, 1.0))?;
            (0..NODES).try_for_each(|node| self.act(node, SharedAct::Follow { newest: None }))?;
        }
        let agreeing = self.nodes.iter().filter_map(|node| {
            let process = node.process.as_ref().filter(|it| it.worker.stopped.get().is_none())?;
            let agrees = process.worker.member.as_ref().is_some_and(Member::agrees);
            agrees.then_some((&node.name, process))
        });
        let agreeing: Vec<_> = agreeing.collect();
        for (name, process) in &agreeing {
            let (revision, state) = (process.map.revision(), process.map.state_hash());
            for (other_name, other) in &agreeing {
                let theirs = other.recent.hashes_at(revision).map(|hashes| hashes.state);
                if theirs.is_some_and(|theirs| theirs != state) {
                    let what =
                        format!("{name} and {other_name} differ at revision {revision}, and nobody says so");
                    return Err(Violation(what));
                }
            }
        }
        Ok(())
    }
}
