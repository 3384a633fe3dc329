//! Random histories of three nodes that share a map over a log that fails: nothing acknowledged is missing, nothing is
//! applied twice, and all nodes are equal at every revision. Where a rule is left out, histories show it.
//!
//!     MROL_HISTORIES=100000 cargo test --package mrol-service --lib histories
//!     MROL_HISTORY=116 cargo test --package mrol-service --lib histories -- --nocapture    one alone, told step by step

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use parking_lot::Mutex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tokio::sync::{oneshot, watch};
use uuid::Uuid;

use super::recent_changes::RecentChanges;
use super::scan_turn::TurnLimits;
use super::submission::{Outcome, Prepared, Refusal, SharedAct, Submission, Waiting, record_of};
use super::worker::{Published, Worker};
use crate::error::{Reason, ServiceError};
use crate::limits::Marks;
use crate::replication::{Failures, Member, MemoryLog, NodeLog, NodeName, Rule};
use crate::resources::ResourceBudget;
use crate::work::{Asker, Requester};
use mrol_map::geometry::Pose;
use mrol_map::map::{
    Change, MapName, MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord, StateHash,
};
use mrol_map::voxel::{VoxelKey, VoxelSet};
use mrol_store::{DataDir, MapFolder, OpeningProgress, Snapshot, StoreSettings};

#[path = "../../../../tests/support/simulated_disk.rs"]
#[expect(dead_code, unreachable_pub, reason = "of all that fails, here it is the power")]
mod simulated;

const NODES: usize = 3;
const MAP: Uuid = Uuid::from_u128(7);
/// Steps of a history.
const STEPS: usize = 60;
/// Bytes of a message: a change of many voxels takes several.
const PIECE_BYTES: usize = 400;
/// How often somebody whose change was decided on a map that went on sends it again.
const STALE_MAX: usize = 5;

/// What a history must not show.
#[derive(Debug)]
struct Violation(String);

type Checked = Result<(), Violation>;

struct Node {
    name: NodeName,
    disk: simulated::SimulatedDisk,
    /// None while it is down.
    process: Option<Process>,
}

struct Process {
    worker: Worker,
    map: Arc<MultiResolutionMap>,
    folder: Arc<MapFolder>,
    recent: Arc<RecentChanges>,
    /// Up to where its revisions were compared with the others'.
    compared: u64,
}

struct History {
    rng: ChaCha8Rng,
    log: Arc<Mutex<MemoryLog>>,
    nodes: Vec<Node>,
    left_out: Option<Rule>,
    /// The log goes back at any time: what parts histories then is to be told.
    is_double: bool,
    /// The next change.
    next: i32,
    acknowledged: BTreeSet<i32>,
    /// Told as not made, for certain.
    refused: BTreeSet<i32>,
    /// What some node had at a revision.
    states: BTreeMap<u64, StateHash>,
    /// A map of the log's base, for nodes that are behind it.
    base: Snapshot,
    /// The log lost what is to be given back: until then no node goes down for good.
    is_fragile: bool,
    is_told: bool,
}

fn settings() -> MapSettings {
    MapSettings { filter: None, moments: false, ..MapSettings::new(1.0, 1) }
}

fn name() -> MapName {
    MapName::new("shared").unwrap()
}

fn marker(change: i32) -> VoxelKey {
    VoxelKey::new([change, 0, 0]).unwrap()
}

/// A change with a voxel of its own, and others where it is large.
fn change_of(number: i32, is_large: bool) -> Change {
    let others = (0..if is_large { 900 } else { 3 })
        .filter_map(|i| VoxelKey::new([number, 1 + i * i % 97, i * 7 % 211]));
    let voxels: VoxelSet = std::iter::once(marker(number)).chain(others).collect();
    let pose = MappedScan::new(RobotName::new("robot").unwrap(), Pose::identity());
    Change::Insertion(ScanRecord::of_voxels(pose, voxels))
}

fn prepared(change: Change) -> Submission {
    let robot_lock = Arc::new(tokio::sync::Mutex::new(())).try_lock_owned().unwrap();
    Submission::Prepared(Box::new(Prepared {
        record: Some(record_of(&change).unwrap()),
        change,
        if_empty: false,
        limits: TurnLimits { carved_at: 0, viewpoint_bytes_max: 0 },
        robot_lock: Arc::new(robot_lock),
        reservation: ResourceBudget::new(None, Marks::default()).reserve(0).unwrap(),
    }))
}

impl Node {
    /// Starts its process on what its disk has; a new map of `base` where that is nothing.
    fn start(&mut self, log: &Arc<Mutex<MemoryLog>>, base: &Snapshot, left_out: Option<Rule>) -> Checked {
        let store = StoreSettings::default();
        let dir = DataDir::on(Arc::new(self.disk.clone()), Path::new("data"), store.clone()).unwrap();
        let progress = OpeningProgress::default();
        if dir.names().unwrap().is_empty() {
            drop(dir.create(&name(), base).unwrap());
        }
        let opened = dir.map(&name(), &progress).map_err(|error| Violation(format!("{error}")))?;
        let (map, folder) = (Arc::new(opened.map), Arc::new(opened.folder));
        let recent = Arc::new(RecentChanges::new(map.revision(), opened.history, 0));
        let published =
            Published { announced: watch::Sender::new(map.revision()), recent: Arc::clone(&recent) };
        let member = Member::join(Arc::new(NodeLog(Arc::clone(log))), self.name.clone(), MAP);
        let mut worker = Worker::new(
            name(),
            Arc::clone(&map),
            Some(Arc::clone(&folder)),
            published,
            Arc::default(),
            Arc::default(),
            &store,
        );
        worker.member = Some(member.without(left_out).with_pieces_of(PIECE_BYTES));
        self.process = Some(Process { worker, map, folder, recent, compared: 0 });
        Ok(())
    }
}

impl Process {
    fn commit(&mut self, submissions: Vec<Submission>) -> Vec<Outcome> {
        let (waiting, outcomes): (Vec<_>, Vec<_>) = submissions
            .into_iter()
            .map(|submission| {
                let (answer, outcome) = oneshot::channel();
                let requester = Requester::from(&Asker::default());
                (Waiting { submission, answer, requester, _place: None }, outcome)
            })
            .unzip();
        self.worker.commit(waiting);
        outcomes
            .into_iter()
            .map(|mut outcome| outcome.try_recv().expect("every change is answered"))
            .collect()
    }

    fn act(&mut self, act: SharedAct) -> Outcome {
        self.commit(vec![Submission::Shared(act)]).remove(0)
    }
}

impl History {
    fn new(seed: u64, left_out: Option<Rule>) -> Self {
        let base = Snapshot::of(&MultiResolutionMap::new(settings()).unwrap(), MAP);
        let node = |i| Node {
            name: NodeName::new(&format!("node-{i}")).unwrap(),
            disk: simulated::SimulatedDisk::default(),
            process: None,
        };
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
            log: Arc::new(Mutex::new(MemoryLog::new(seed))),
            nodes: (0..NODES).map(node).collect(),
            left_out,
            is_double: false,
            next: 0,
            acknowledged: BTreeSet::new(),
            refused: BTreeSet::new(),
            states: BTreeMap::new(),
            base,
            is_fragile: false,
            is_told: std::env::var_os("MROL_HISTORY").is_some(),
        }
    }

    /// Prints what happened, where one history alone is looked at.
    fn tell(&self, what: impl FnOnce() -> String) {
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

    fn run(mut self) -> Checked {
        (0..NODES).try_for_each(|node| self.start(node))?;
        for _ in 0..STEPS {
            self.step()?;
            self.tell(|| format!("log of {}, fragile {}", self.log.lock().len(), self.is_fragile));
            self.compare()?;
        }
        self.heal()
    }

    fn step(&mut self) -> Checked {
        let node = self.rng.random_range(0..NODES);
        match self.rng.random_range(0..100) {
            0..40 => self.change(node)?,
            40..60 => self.act(node, SharedAct::Follow { newest: None })?,
            60..72 => self.lead(node)?,
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
    fn change(&mut self, node: usize) -> Checked {
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

    fn act(&mut self, node: usize, act: SharedAct) -> Checked {
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
    fn heed(&mut self, node: usize, revision: u64, error: &ServiceError) -> Checked {
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

    /// A node tries to take over; it knows how far the live ones are.
    fn lead(&mut self, node: usize) -> Checked {
        let live = self.nodes.iter().enumerate().filter(|(other, _)| *other != node);
        let live = live.filter_map(|(_, it)| {
            // One that parted from the log leads nobody.
            let process = it.process.as_ref().filter(|process| process.worker.stopped.get().is_none())?;
            Some((it.name.clone(), process.map.revision()))
        });
        let live = live.collect();
        self.act(node, SharedAct::Lead(live))?;
        let Some(process) = &self.nodes[node].process else { return Ok(()) };
        let end = self.log.lock().end();
        if process.worker.member.as_ref().is_some_and(|it| it.leads() && it.position() == end) {
            self.is_fragile = false;
        }
        Ok(())
    }

    /// A process is killed, or its machine loses its power, or its disk.
    fn stop(&mut self, node: usize) {
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

    fn wipe(&mut self, node: usize) {
        self.nodes[node].process = None;
        self.nodes[node].disk = simulated::SimulatedDisk::default();
    }

    fn start(&mut self, node: usize) -> Checked {
        match self.nodes[node].process {
            Some(_) => Ok(()),
            None => self.nodes[node].start(&self.log, &self.base, self.left_out),
        }
    }

    /// A node writes a snapshot; the power may go meanwhile.
    fn save(&mut self, node: usize) {
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
    fn cut_log(&mut self, node: usize) {
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
    fn lose_newest(&mut self) {
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
        if is_whole && !self.is_fragile && self.left_out.is_none() {
            let messages = self.rng.random_range(1..8).min(log.len());
            log.lose_newest(messages);
            if self.is_told {
                println!("the log loses {messages}");
            }
            self.is_fragile = true;
        }
    }

    /// Every node has at each of its revisions what the others have.
    fn compare(&mut self) -> Checked {
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
    fn heal(mut self) -> Checked {
        self.log.lock().set_failures(Failures::default());
        (0..NODES).try_for_each(|node| self.start(node))?;
        for _ in 0..2 {
            for node in 0..NODES {
                self.act(node, SharedAct::Follow { newest: None })?;
                self.start(node)?;
            }
        }
        let revision = |node: &Node| node.process.as_ref().map_or(0, |process| process.map.revision());
        (0..NODES).try_for_each(|node| self.lead(node))?;
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

    /// Nodes that have not said that their histories differ are equal.
    fn check_told(&mut self) -> Checked {
        for _ in 0..2 {
            (0..NODES).try_for_each(|node| self.lead(node))?;
            (0..NODES).try_for_each(|node| self.act(node, SharedAct::Follow { newest: None }))?;
        }
        let agreeing = self.nodes.iter().filter_map(|node| {
            let process = node.process.as_ref().filter(|it| it.worker.stopped.get().is_none())?;
            let agrees = process.worker.member.as_ref().is_some_and(Member::agrees);
            let map = &process.map;
            agrees.then(|| (&node.name, (map.revision(), map.state_hash(), map.trajectory().scans())))
        });
        let agreeing: Vec<_> = agreeing.collect();
        match agreeing.iter().find(|(_, at)| *at != agreeing[0].1) {
            Some(other) => {
                Err(Violation(format!("{:?} and {other:?} differ, and nobody says so", agreeing[0])))
            }
            None => Ok(()),
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

fn histories() -> u64 {
    std::env::var("MROL_HISTORIES").map_or(3_000, |text| text.parse().unwrap())
}

#[test]
fn nothing_acknowledged_is_lost_and_nothing_is_made_twice() {
    let one = std::env::var("MROL_HISTORY").ok().map(|text| text.parse::<u64>().unwrap());
    let seeds = one.map_or(0..histories(), |seed| seed..seed + 1);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let run = &|first: usize| {
        for seed in seeds.clone().skip(first).step_by(threads) {
            if let Err(Violation(what)) = History::new(seed, None).run() {
                panic!("history {seed}: {what}");
            }
        }
    };
    std::thread::scope(|scope| (0..threads).for_each(|first| drop(scope.spawn(move || run(first)))));
}

#[test]
fn a_node_that_leaves_out_a_rule_is_found_out() {
    for rule in [Rule::OwnEpoch, Rule::Position, Rule::CaughtUp, Rule::SameId] {
        let found = (0..histories())
            .find_map(|seed| History::new(seed, Some(rule)).run().err().map(|Violation(what)| (seed, what)));
        let (seed, what) = found.unwrap_or_else(|| panic!("{rule:?} is left out, and no history shows it"));
        println!("without {rule:?}: history {seed}: {what}");
    }
}

#[test]
fn where_two_faults_part_histories_it_is_told() {
    for seed in 0..histories() / 3 {
        let history = History { is_double: true, ..History::new(seed, None) };
        if let Err(Violation(what)) = history.run() {
            panic!("history {seed}: {what}");
        }
    }
}

#[path = "faults.rs"]
mod faults;
