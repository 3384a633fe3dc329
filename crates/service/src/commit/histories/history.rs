//! What happens in a history, at random.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use parking_lot::Mutex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::changes::{MAP, change_of, prepared, settings};
use super::node::{NODES, Node, simulated};
use crate::commit::submission::{Refusal, SharedAct};
use crate::error::{Reason, ServiceError};
use crate::replication::{Failures, Member, MemoryLog, NodeName, Rule};
use mrol_map::map::{MultiResolutionMap, StateHash};
use mrol_store::{Snapshot, StoreSettings};

/// Steps of a history.
const STEPS: usize = 60;
/// How often somebody whose change was decided on a map that went on sends it again.
const STALE_MAX: usize = 5;

/// What a history must not show.
#[derive(Debug)]
pub(super) struct Violation(pub(super) String);

pub(super) type Checked = Result<(), Violation>;

pub(super) struct History {
    pub(super) rng: ChaCha8Rng,
    pub(super) log: Arc<Mutex<MemoryLog>>,
    pub(super) nodes: Vec<Node>,
    pub(super) left_out: Option<Rule>,
    /// The log goes back at any time: what parts histories then is to be told.
    pub(super) is_double: bool,
    /// How nodes keep the map.
    pub(super) store: StoreSettings,
    /// The next change.
    pub(super) next: i32,
    pub(super) acknowledged: BTreeSet<i32>,
    /// Told as not made, for certain.
    pub(super) refused: BTreeSet<i32>,
    /// What some node had at a revision.
    pub(super) states: BTreeMap<u64, StateHash>,
    /// A map of the log's base, for nodes that are behind it.
    pub(super) base: Snapshot,
    /// The log lost what is to be given back: until then no node goes down for good.
    pub(super) is_fragile: bool,
    pub(super) is_told: bool,
}

impl History {
    pub(super) fn new(seed: u64, left_out: Option<Rule>) -> Self {
        let base = Snapshot::of(&MultiResolutionMap::new(settings()).unwrap(), MAP);
        let node = |i| Node {
            name: NodeName::new(&format!("node-{i}")).unwrap(),
            disk: simulated::SimulatedDisk::default(),
            process: None,
            beat: None,
        };
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
            log: Arc::new(Mutex::new(MemoryLog::new(seed))),
            nodes: (0..NODES).map(node).collect(),
            left_out,
            is_double: false,
            store: StoreSettings::default(),
            next: 0,
            acknowledged: BTreeSet::new(),
            refused: BTreeSet::new(),
            states: BTreeMap::new(),
            base,
            is_fragile: false,
            is_told: std::env::var_os("MROL_HISTORY").is_some(),
        }
    }

    /// A history in which the log goes back at any time; where `is_pruned`, nodes keep no records that a snapshot
    /// holds.
    pub(super) fn of_two_faults(seed: u64, is_pruned: bool) -> Self {
        let store = match is_pruned {
            true => StoreSettings {
                undo_revisions: 0,
                undo_bytes_max: 0,
                segment_bytes_max: 300,
                ..Default::default()
            },
            false => StoreSettings::default(),
        };
        Self { is_double: true, store, ..Self::new(seed, None) }
    }

    /// Prints what happened, where one history alone is looked at.
    pub(super) fn tell(&self, what: impl FnOnce() -> String) {
        if self.is_told {
            let at = self.nodes.iter().map(|node| {
                let process = node.process.as_ref()?;
                let member = process.worker.member.as_ref()?;
                Some((
                    process.map.revision(),
                    member.head(),
                    member.position().sequence,
                    member.epoch(),
                    member.leads(),
                ))
            });
            println!("{}: {:?}", what(), at.collect::<Vec<_>>());
        }
    }

    pub(super) fn run(mut self) -> Checked {
        (0..NODES).try_for_each(|node| self.start(node))?;
        for _ in 0..STEPS {
            self.step()?;
            self.tell(|| format!("log of {}, fragile {}", self.log.lock().len(), self.is_fragile));
            self.compare()?;
        }
        self.heal()
    }

    pub(super) fn step(&mut self) -> Checked {
        let node = self.rng.random_range(0..NODES);
        match self.rng.random_range(0..100) {
            0..40 => self.change(node)?,
            40..60 => self.act(node, SharedAct::Follow { newest: None })?,
            60..66 => self.lead(node, 0.8)?,
            66..68 => self.claim(node)?,
            68..70 => self.open(node)?,
            70..72 => self.beat(node),
            72..75 => {
                let to = self.nodes[self.rng.random_range(0..NODES)].name.clone();
                self.act(node, SharedAct::HandOver(to))?;
            }
            75..83 => self.log.lock().set_failures(failures(&mut self.rng)),
            83..88 => self.stop(node),
            88..93 => self.start(node)?,
            93..95 => self.save(node),
            95..97 => self.cut_log(node),
            _ => self.lose_newest(),
        }
        Ok(())
    }

    /// Some changes are asked of a node, at once; who hears that the map went on sends its change again.
    pub(super) fn change(&mut self, node: usize) -> Checked {
        let numbers = self.next..self.next + self.rng.random_range(1..4);
        self.next = numbers.end;
        let large = self.rng.random_range(0..20);
        let mut waiting: Vec<i32> = numbers.collect();
        for _ in 0..STALE_MAX {
            let Some(process) = &mut self.nodes[node].process else { return Ok(()) };
            let revision = process.map.revision();
            let submissions = waiting.iter().map(|&number| prepared(change_of(number, number % 20 == large)));
            let outcomes = process.commit(submissions.collect());
            let mut stale = Vec::new();
            for (number, outcome) in waiting.into_iter().zip(outcomes) {
                if self.is_told {
                    println!("change {number} at node {node}: {outcome:?}");
                }
                match outcome {
                    Ok(_) => drop(self.acknowledged.insert(number)),
                    Err(Refusal::Stale) => stale.push(number),
                    Err(Refusal::Failed(error)) => {
                        if matches!(error.reason, Reason::NotLeader | Reason::NoQuorum) {
                            self.refused.insert(number);
                        }
                        self.heed(node, revision, &error)?;
                    }
                }
            }
            waiting = stale;
        }
        Ok(())
    }

    pub(super) fn act(&mut self, node: usize, act: SharedAct) -> Checked {
        let Some(process) = &mut self.nodes[node].process else { return Ok(()) };
        let revision = process.map.revision();
        let told = self.is_told.then(|| format!("node {node}: {act:?}"));
        let outcome = process.act(act);
        if let Some(told) = told {
            println!("{told}: {outcome:?}");
        }
        match outcome {
            Ok(_) | Err(Refusal::Stale) => Ok(()),
            Err(Refusal::Failed(error)) => self.heed(node, revision, &error),
        }
    }

    /// What a node said that was at a revision: one that the log has left behind begins again at the base.
    pub(super) fn heed(&mut self, node: usize, revision: u64, error: &ServiceError) -> Checked {
        match error.reason {
            Reason::NotLeader | Reason::NoQuorum | Reason::OutcomeUnknown => Ok(()),
            Reason::HistoriesDiffer if self.is_double => Ok(()),
            // It cannot tell whether the log is of its history; others can.
            Reason::HistoriesDiffer
                if self.nodes[node].process.as_ref().is_some_and(|it| it.worker.stopped.get().is_none()) =>
            {
                Ok(())
            }
            Reason::HistoriesDiffer if revision < self.log.lock().base().revision => {
                self.wipe(node);
                self.start(node)
            }
            _ => Err(Violation(error.to_string())),
        }
    }

    /// A node says how far it is, and which claim it has read last.
    pub(super) fn beat(&mut self, node: usize) {
        let Node { process, beat, .. } = &mut self.nodes[node];
        // One that parted from the log leads nobody.
        let process = process.as_ref().filter(|process| process.worker.stopped.get().is_none());
        let member = process.and_then(|process| process.worker.member.as_ref());
        *beat = process.zip(member).map(|(process, member)| (member.last_claim(), process.map.revision()));
    }

    /// A node claims to lead.
    pub(super) fn claim(&mut self, node: usize) -> Checked {
        self.act(node, SharedAct::Claim { epoch: None })
    }

    /// A node takes over what it claimed, if the others have beaten since they read the claim: those that are down are
    /// known to be.
    pub(super) fn open(&mut self, node: usize) -> Checked {
        let Some(process) = &self.nodes[node].process else { return Ok(()) };
        let Some(member) = &process.worker.member else { return Ok(()) };
        let claim = member.last_claim();
        let takes_part =
            |it: &Node| it.process.as_ref().is_some_and(|process| process.worker.stopped.get().is_none());
        let others = self.nodes.iter().enumerate().filter(|(other, it)| *other != node && takes_part(it));
        let beats: Vec<_> = others.map(|(_, it)| (it.name.clone(), it.beat)).collect();
        let are_fresh = beats.iter().all(|(_, beat)| beat.is_some_and(|(its_claim, _)| its_claim == claim));
        if !are_fresh && self.left_out != Some(Rule::FreshHeads) {
            return Ok(());
        }
        let live = beats.into_iter().filter_map(|(name, beat)| Some((name, beat?.1))).collect();
        self.act(node, SharedAct::Open { claim, live })?;
        let Some(process) = &self.nodes[node].process else { return Ok(()) };
        let end = self.log.lock().end();
        if process.worker.member.as_ref().is_some_and(|it| it.leads() && it.position() == end) {
            self.is_fragile = false;
        }
        Ok(())
    }

    /// A node takes over; the others read its claim, each as likely as said, and say how far they are.
    pub(super) fn lead(&mut self, node: usize, reading: f64) -> Checked {
        self.claim(node)?;
        if self.rng.random_bool(0.3) {
            // Before it has heard of the others.
            self.open(node)?;
        }
        for other in 0..NODES {
            if self.rng.random_bool(reading) {
                self.act(other, SharedAct::Follow { newest: None })?;
            }
            self.beat(other);
        }
        self.open(node)
    }

    /// A process is killed, or its machine loses its power, or its disk.
    pub(super) fn stop(&mut self, node: usize) {
        if self.is_fragile {
            return;
        }
        self.nodes[node].process = None;
        self.tell(|| format!("node {node} goes down"));
        match self.rng.random_range(0..4) {
            0 => self.nodes[node].disk = self.nodes[node].disk.after_crash(self.rng.random()),
            1 => self.wipe(node),
            _ => {}
        }
    }

    pub(super) fn wipe(&mut self, node: usize) {
        self.nodes[node].process = None;
        self.nodes[node].disk = simulated::SimulatedDisk::default();
    }

    pub(super) fn start(&mut self, node: usize) -> Checked {
        match self.nodes[node].process {
            Some(_) => Ok(()),
            None => {
                let started = self.nodes[node].start(&self.log, &self.base, self.left_out, &self.store);
                started.map_err(|error| Violation(error.to_string()))
            }
        }
    }

    /// A node writes a snapshot; the power may go meanwhile.
    pub(super) fn save(&mut self, node: usize) {
        let is_cut_short = !self.is_fragile && self.rng.random_bool(0.5);
        let Node { disk, process, .. } = &mut self.nodes[node];
        let Some(running) = process else { return };
        if is_cut_short {
            disk.set_fault(Some(simulated::Fault::Crash(self.rng.random_range(0..6))));
        }
        let saved = running.folder.save(&Snapshot::of(&running.map, MAP), u64::MAX);
        if saved.is_err() {
            *process = None;
            *disk = disk.after_crash(self.rng.random());
        }
        disk.set_fault(None);
    }

    /// A node's map becomes the base of the log.
    pub(super) fn cut_log(&mut self, node: usize) {
        let Some(process) = &self.nodes[node].process else { return };
        let Some(member) = &process.worker.member else { return };
        let base = process.worker.base_here();
        // A place in the log as it was before an older copy was put back is none of this log.
        let is_of_this_log = member.fetch().is_ok();
        let Some(base) = base.filter(|_| is_of_this_log && !self.is_fragile) else { return };
        let mut log = self.log.lock();
        if base.position.sequence > log.base().position.sequence {
            log.cut(base);
            self.base = Snapshot::of(&process.map, MAP);
        }
    }

    /// An older copy of the log is put back, where one fault is enough to show what is looked for: all nodes are there,
    /// one of them has made all that is lost, and no leader is there that has not heard of its successor (it could go
    /// on in the older copy: then nodes say that their histories differ).
    pub(super) fn lose_newest(&mut self) {
        let mut log = self.log.lock();
        if self.is_double {
            let messages = self.rng.random_range(1..8).min(log.len());
            return log.lose_newest(messages);
        }
        let members: Vec<&Member> =
            self.nodes.iter().filter_map(|node| node.process.as_ref()?.worker.member.as_ref()).collect();
        let has_all = |member: &&Member| member.position() == log.end();
        let is_whole = members.len() == NODES
            && members.iter().any(has_all)
            && members.iter().all(|member| !member.leads() || member.epoch() == log.epoch());
        let is_looked_for = matches!(self.left_out, None | Some(Rule::FreshHeads));
        if is_whole && !self.is_fragile && is_looked_for {
            let messages = self.rng.random_range(1..8).min(log.len());
            log.lose_newest(messages);
            if self.is_told {
                println!("the log loses {messages}");
            }
            self.is_fragile = true;
        }
    }
}

fn failures(rng: &mut ChaCha8Rng) -> Failures {
    let mut percent = |most: u32| if rng.random_bool(0.5) { rng.random_range(0..most) } else { 0 };
    Failures {
        lost_acknowledgment: percent(80),
        lost_message: percent(50),
        late_message: percent(50),
        late_reader: percent(60),
        no_quorum: percent(10) > 7,
    }
}
