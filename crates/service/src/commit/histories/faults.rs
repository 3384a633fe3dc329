//! What a hostile reader found: single faults, each in the order of events that showed it.

use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::oneshot;
use uuid::Uuid;

use super::changes::{MAP, change_of, marker, prepared, prepared_at, settings};
use super::history::History;
use super::node::{NODES, Node, Process, simulated};
use crate::commit::submission::{Outcome, Refusal, SharedAct, Submission, Waiting, record_of};
use crate::error::Reason;
use crate::replication::{Base, Body, Entry, LogError, Message, NotPublished, Position, ReplicatedLog};
use crate::replication::{Failures, MemoryLog, NodeLog, NodeName};
use crate::work::{Asker, Requester};
use mrol_map::geometry::Pose;
use mrol_map::map::{Change, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol_map::voxel::VoxelSet;
use mrol_store::Snapshot;
use std::sync::atomic::{AtomicUsize, Ordering};

fn lead(history: &mut History, node: usize) -> Outcome {
    let process = history.nodes[node].process.as_mut().unwrap();
    process.act(SharedAct::Claim { epoch: None })?;
    let claim = process.worker.member.as_ref().unwrap().last_claim();
    process.act(SharedAct::Open { claim, live: Vec::new() })
}

fn follow(history: &mut History, node: usize) -> Outcome {
    history.nodes[node].process.as_mut().unwrap().act(SharedAct::Follow { newest: None })
}

fn change(history: &mut History, node: usize, numbers: &[i32]) -> Vec<Outcome> {
    let submissions = numbers.iter().map(|&number| prepared(change_of(number, false))).collect();
    history.nodes[node].process.as_mut().unwrap().commit(submissions)
}

/// Changes that are acknowledged; who hears that the map went on asks again.
fn made(history: &mut History, node: usize, numbers: &[i32]) {
    let mut outcomes = change(history, node, numbers);
    if outcomes.iter().all(|outcome| matches!(outcome, Err(Refusal::Stale))) {
        outcomes = change(history, node, numbers);
    }
    assert!(outcomes.iter().all(Result::is_ok), "{outcomes:?}");
}

fn begun() -> History {
    let mut history = History::new(1, None);
    (0..NODES).for_each(|node| history.start(node).unwrap());
    with_large_messages(&mut history);
    history
}

fn with_large_messages(history: &mut History) {
    for node in &mut history.nodes {
        let member = &mut node.process.as_mut().unwrap().worker.member;
        let all = member.take().unwrap().with_pieces_of(100_000);
        *member = Some(all);
    }
}

fn has(history: &History, node: usize, number: i32) -> bool {
    history.nodes[node].process.as_ref().unwrap().map.view().contains(marker(number), 0)
}

#[test]
fn a_change_in_the_log_is_not_told_as_refused_where_the_folder_failed() {
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    made(&mut history, 0, &[0]);
    let Node { disk, process, .. } = &mut history.nodes[0];
    let process = process.as_mut().unwrap();
    disk.set_fault(Some(simulated::Fault::Fails(0)));
    let failed = process.folder.sync();
    assert!(failed.is_err());
    disk.set_fault(None);
    let outcome = change(&mut history, 0, &[1]).remove(0);
    follow(&mut history, 1).unwrap();
    let Err(Refusal::Failed(error)) = outcome else { panic!("{outcome:?}") };
    assert!(!has(&history, 1, 1) || error.reason == Reason::OutcomeUnknown, "{error}");
}

/// A node whose disk begins with a snapshot, as `copy_map` makes it: no journal and no hashes of before.
fn as_copy(history: &mut History, node: usize, numbers: &[i32]) {
    let map = MultiResolutionMap::new(settings()).unwrap();
    for &number in numbers {
        map.committer().apply(&change_of(number, false));
    }
    let base = std::mem::replace(&mut history.base, Snapshot::of(&map, MAP));
    history.wipe(node);
    history.start(node).unwrap();
    history.base = base;
    let member = &mut history.nodes[node].process.as_mut().unwrap().worker.member;
    *member = Some(member.take().unwrap().with_pieces_of(100_000));
}

#[test]
fn a_node_that_could_compare_nothing_does_not_lead() {
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    (0..5).for_each(|n| made(&mut history, 0, &[n]));
    as_copy(&mut history, 2, &[0, 1, 2, 33, 34]);
    let led = lead(&mut history, 2);
    let changed = change(&mut history, 2, &[50]).remove(0);
    assert!(led.is_err() && changed.is_err());
}

#[test]
fn nothing_is_made_upon_a_history_that_was_not_compared() {
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    (0..3).for_each(|n| made(&mut history, 0, &[n]));
    made(&mut history, 0, &[3, 4, 5]);
    as_copy(&mut history, 2, &[0, 1, 2, 33, 34]);
    let followed = follow(&mut history, 2);
    let process = history.nodes[2].process.as_ref().unwrap();
    let agrees = process.worker.member.as_ref().unwrap().agrees();
    assert!(followed.is_err(), "made revision 6 upon 4 and 5 of another history; agrees: {agrees}");
    // It says the same when it is asked again, and is not at the place of what it did not make.
    let again = follow(&mut history, 2);
    assert_eq!(format!("{again:?}"), format!("{followed:?}"));
    assert!(history.nodes[2].process.as_ref().unwrap().worker.stopped.get().is_none());
}

#[test]
fn a_node_that_cannot_give_back_what_the_log_lacks_does_not_claim() {
    let mut history = begun();
    as_copy(&mut history, 2, &[0, 1, 2]);
    let led = lead(&mut history, 2);
    let Err(Refusal::Failed(error)) = led else { panic!() };
    assert_eq!(history.log.lock().len(), 0, "it claimed");
    assert_ne!(error.reason, Reason::NoQuorum, "{error}");
}

#[test]
fn a_follower_does_not_answer_that_there_is_nothing_to_change() {
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    made(&mut history, 0, &[0]);
    let delete_all = Submission::Undecided(Box::new(|map, _| match map.is_empty() {
        true => Ok(None),
        false => panic!("not reached"),
    }));
    let outcome = history.nodes[1].process.as_mut().unwrap().commit(vec![delete_all]).remove(0);
    assert!(
        outcome.is_err(),
        "an acknowledged change is there; the follower says that there is nothing to delete"
    );
}

#[test]
fn a_change_is_made_once_where_the_log_goes_back_between_two_attempts() {
    struct GoesBack {
        log: Arc<Mutex<MemoryLog>>,
        published: AtomicUsize,
        follower: Mutex<Option<Process>>,
    }
    impl std::fmt::Debug for GoesBack {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("GoesBack")
        }
    }
    impl ReplicatedLog for GoesBack {
        fn publish(&self, message: &Message, position: Position) -> Result<(), NotPublished> {
            let log = NodeLog(Arc::clone(&self.log));
            if !matches!(message.body, Body::Changes(_)) {
                return log.publish(message, position);
            }
            match self.published.fetch_add(1, Ordering::Relaxed) {
                2 => {
                    log.publish(message, position).unwrap();
                    // A follower makes it, and an older copy is put back.
                    self.follower.lock().as_mut().unwrap().act(SharedAct::Follow { newest: None }).unwrap();
                    self.log.lock().lose_newest(2);
                    Err(NotPublished::Unknown("the leader of the stream is gone".into()))
                }
                _ => log.publish(message, position),
            }
        }
        fn base(&self) -> Result<Base, LogError> {
            NodeLog(Arc::clone(&self.log)).base()
        }
        fn read_behind(&self, position: Position) -> Result<Vec<Entry>, LogError> {
            NodeLog(Arc::clone(&self.log)).read_behind(position)
        }
    }
    let mut history = begun();
    let follower = history.nodes[1].process.take();
    let log = Arc::new(GoesBack {
        log: Arc::clone(&history.log),
        published: AtomicUsize::new(0),
        follower: Mutex::new(follower),
    });
    let act =
        SharedAct::Join { log: Arc::<GoesBack>::clone(&log), node: history.nodes[0].name.clone(), map: MAP };
    history.nodes[0].process.as_mut().unwrap().act(act).unwrap();
    lead(&mut history, 0).unwrap();
    made(&mut history, 0, &[0]);
    made(&mut history, 0, &[1]);
    let outcome = change(&mut history, 0, &[2]).remove(0);
    history.nodes[1].process = log.follower.lock().take();
    let stale = matches!(outcome, Err(Refusal::Stale));
    if stale {
        drop(change(&mut history, 1, &[2]));
    }
    let scans = history.nodes[1].process.as_ref().unwrap().map.trajectory().scans();
    assert_eq!(scans, 3, "three changes");
}

#[test]
fn what_cannot_be_made_does_not_come_into_the_folder() {
    use crate::replication::{Changes, Piece};
    use mrol_store::frames_of;
    let mut history = begun();
    let node = history.nodes[0].name.clone();
    let log = NodeLog(Arc::clone(&history.log));
    let claim = Message { id: Uuid::from_u128(1), after: None, epoch: 1, body: Body::Claim(node) };
    log.publish(&claim, Position::default()).unwrap();
    // A scan of more levels than this map has.
    let mut far = MappedScan::new(RobotName::new("robot").unwrap(), Pose::identity());
    far.level_overlaps = vec![0.0; 5];
    let change = Change::Insertion(ScanRecord::of_voxels(far, VoxelSet::default()));
    let record = record_of(&change).unwrap();
    let frames = frames_of(&[&record], 1, MAP).into();
    let body = Body::Changes(Changes { first: 1, last: 1, state_before: None, piece: Piece::WHOLE, frames });
    let message = Message { id: Uuid::from_u128(2), after: Some(claim.id), epoch: 1, body };
    log.publish(&message, Position { sequence: 1, id: Some(claim.id) }).unwrap();
    history.nodes[1].process = None;
    let opened = history.start(1);
    opened.unwrap();
}

#[test]
fn another_record_of_the_bases_revision_is_another_history() {
    #[derive(Debug)]
    struct Based(Base);
    impl ReplicatedLog for Based {
        fn publish(&self, _: &Message, _: Position) -> Result<(), NotPublished> {
            Err(NotPublished::Refused)
        }
        fn base(&self) -> Result<Base, LogError> {
            Ok(self.0.clone())
        }
        fn read_behind(&self, _: Position) -> Result<Vec<Entry>, LogError> {
            Ok(Vec::new())
        }
    }
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    made(&mut history, 0, &[0, 1]);
    let base = history.nodes[0].process.as_ref().unwrap().worker.base_here().unwrap();
    let other = Base { checksum: base.checksum.map(|it| it ^ 1), ..base };
    let act = SharedAct::Join { log: Arc::new(Based(other)), node: history.nodes[0].name.clone(), map: MAP };
    let joined = history.nodes[0].process.as_mut().unwrap().act(act);
    assert!(joined.is_err(), "another record made the base's revision");
}

#[test]
fn a_map_that_is_not_shared_does_not_lead() {
    let mut history = begun();
    history.nodes[0].process.as_mut().unwrap().worker.member = None;
    let led = lead(&mut history, 0);
    assert_eq!(history.log.lock().len(), 0);
    assert!(led.is_err(), "it acknowledged what is in no log");
}

#[test]
fn a_log_that_goes_on_and_on_keeps_no_map_that_was_deleted() {
    use crate::commit::stop::Stop;
    use std::sync::OnceLock;
    #[derive(Debug)]
    struct Endless(Arc<OnceLock<Stop>>, AtomicUsize);
    const ENOUGH: usize = 100_000;
    impl ReplicatedLog for Endless {
        fn publish(&self, _: &Message, _: Position) -> Result<(), NotPublished> {
            Err(NotPublished::Refused)
        }
        fn base(&self) -> Result<Base, LogError> {
            Ok(Base::default())
        }
        fn read_behind(&self, position: Position) -> Result<Vec<Entry>, LogError> {
            let sequence = position.sequence + 1;
            match self.1.fetch_add(1, Ordering::Relaxed) {
                100 => drop(self.0.set(Stop::Deleted)),
                ENOUGH => return Err(LogError::Unavailable("the test ends".into())),
                _ => {}
            }
            let body = Body::Claim(NodeName::new("other").unwrap());
            let message = Message { id: Uuid::new_v4(), after: position.id, epoch: sequence, body };
            Ok(vec![Entry { sequence, message }])
        }
    }
    let mut history = begun();
    let node = &mut history.nodes[0];
    let process = node.process.as_mut().unwrap();
    let log = Arc::new(Endless(Arc::clone(&process.worker.stopped), AtomicUsize::new(0)));
    let act = SharedAct::Join { log: Arc::<Endless>::clone(&log), node: node.name.clone(), map: MAP };
    assert!(process.act(act).is_err());
    let reads = log.1.load(Ordering::Relaxed);
    assert!(reads < ENOUGH, "{reads} reads in one turn, all but a hundred after the map was deleted");
}

#[test]
fn while_the_log_is_silent_only_the_first_that_waits_tries_it() {
    use crate::commit::submission::Decided;
    use mrol_map::map::DeletionRecord;
    #[derive(Debug)]
    struct Dead(NodeLog, AtomicUsize);
    impl ReplicatedLog for Dead {
        fn publish(&self, message: &Message, position: Position) -> Result<(), NotPublished> {
            if matches!(message.body, Body::Claim(_)) {
                return self.0.publish(message, position);
            }
            self.1.fetch_add(1, Ordering::Relaxed);
            Err(NotPublished::Unknown("NATS did not answer within 500 ms".into()))
        }
        fn base(&self) -> Result<Base, LogError> {
            self.0.base()
        }
        fn read_behind(&self, position: Position) -> Result<Vec<Entry>, LogError> {
            self.0.read_behind(position)
        }
    }
    let mut history = begun();
    let log = Arc::new(Dead(NodeLog(Arc::clone(&history.log)), AtomicUsize::new(0)));
    let node = &mut history.nodes[0];
    let process = node.process.as_mut().unwrap();
    process
        .act(SharedAct::Join { log: Arc::<Dead>::clone(&log), node: node.name.clone(), map: MAP })
        .unwrap();
    process.act(SharedAct::Claim { epoch: None }).unwrap();
    let claim = process.worker.member.as_ref().unwrap().last_claim();
    process.act(SharedAct::Open { claim, live: Vec::new() }).unwrap();
    let mut gone = Vec::new();
    for number in 0..100 {
        let (answer, outcome) = oneshot::channel();
        drop(outcome);
        let decide = move |_: &MultiResolutionMap, _: mrol_map::util::StopSignal<'_>| {
            let voxels = std::iter::once(marker(number)).collect();
            let change = Change::Deletion(DeletionRecord { voxels, request: None });
            Ok(Some(Decided { change, record: None, reserved: Vec::new(), pin: None }))
        };
        let requester = Requester::from(&Asker::default());
        let submission = Submission::Undecided(Box::new(decide));
        gone.push(Waiting { submission, answer, requester, _place: None });
    }
    process.worker.commit(gone);
    let attempts = log.1.load(Ordering::Relaxed);
    assert!(attempts < 20);
}

#[test]
fn what_was_not_acknowledged_keeps_its_place_until_it_is_known() {
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    made(&mut history, 0, &[0]);
    history.log.lock().set_failures(Failures { lost_acknowledgment: 100, ..Failures::default() });
    assert!(change(&mut history, 0, &[1]).remove(0).is_err());
    history.log.lock().set_failures(Failures::default());
    follow(&mut history, 1).unwrap();
    assert!(has(&history, 1, 1));
    history.log.lock().lose_newest(1);
    made(&mut history, 0, &[2]);
    let followed = follow(&mut history, 1);
    assert!(followed.is_ok(), "one fault, and no leader of an earlier epoch: {followed:?}");
}

#[test]
fn a_node_that_could_compare_nothing_gives_no_base() {
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    (0..5).for_each(|n| made(&mut history, 0, &[n]));
    as_copy(&mut history, 2, &[0, 1, 2, 33, 34]);
    let (tell, mut told) = oneshot::channel();
    history.nodes[2].process.as_mut().unwrap().act(SharedAct::Base(tell)).unwrap();
    let base = told.try_recv().unwrap();
    assert!(base.is_none(), "a base of a history that is not the log's");
}

/// Seen with real nodes: a scan waited for its turn at a node that lost the lead and took it over again; meanwhile it
/// had been sent again to another, and was made by that. Its id is looked for again.
#[test]
fn a_change_that_was_decided_on_before_another_node_made_changes_is_decided_on_again() {
    let mut history = begun();
    lead(&mut history, 0).unwrap();
    made(&mut history, 0, &[0]);
    let process = history.nodes[0].process.as_mut().unwrap();
    let (seen, to) = (process.map.revision(), NodeName::new("node-1").unwrap());
    process.act(SharedAct::HandOver(to)).unwrap();
    follow(&mut history, 1).unwrap();
    lead(&mut history, 1).unwrap();
    made(&mut history, 1, &[1]);
    follow(&mut history, 0).unwrap();
    lead(&mut history, 0).unwrap();
    let process = history.nodes[0].process.as_mut().unwrap();
    let again = process.commit(vec![prepared_at(seen, change_of(1, false))]).remove(0);
    assert!(matches!(again, Err(Refusal::Stale)), "{again:?}");
    let now = process.map.revision();
    let other = process.commit(vec![prepared_at(now, change_of(2, false))]).remove(0);
    assert!(other.is_ok(), "{other:?}");
}

#[test]
fn a_node_that_went_down_amid_the_changes_of_a_message_goes_on_with_the_rest() {
    for writes in 0..24 {
        // The node keeps no records that its snapshot holds: of what was before, nothing is left to compare.
        let mut history = History::of_two_faults(1, true);
        (0..NODES).for_each(|node| history.start(node).unwrap());
        with_large_messages(&mut history);
        lead(&mut history, 0).unwrap();
        for number in 0..10 {
            made(&mut history, 0, &[number]);
            follow(&mut history, 1).unwrap();
            let process = history.nodes[1].process.as_ref().unwrap();
            if number < 9 {
                process.folder.save(&Snapshot::of(&process.map, MAP), u64::MAX).unwrap();
                process.folder.give_up_undo().unwrap();
            }
        }
        made(&mut history, 0, &[10, 11, 12, 13]);
        history.nodes[1].disk.set_fault(Some(simulated::Fault::FallsShort(writes)));
        drop(follow(&mut history, 1));
        history.nodes[1].process = None;
        history.nodes[1].disk.set_fault(None);
        history.start(1).unwrap();
        follow(&mut history, 1).unwrap_or_else(|error| panic!("after {writes} writes: {error:?}"));
        assert!((0..14).all(|number| has(&history, 1, number)), "after {writes} writes");
    }
}
