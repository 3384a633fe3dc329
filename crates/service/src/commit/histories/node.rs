//! A node of a history: the worker of a map on a simulated disk.

use std::path::Path;
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::{oneshot, watch};
use uuid::Uuid;

use super::changes::{MAP, name};
use crate::commit::lead::Lead;
use crate::commit::recent_changes::RecentChanges;
use crate::commit::submission::{Outcome, SharedAct, Submission, Waiting};
use crate::commit::worker::{Published, Worker};
use crate::replication::{Member, MemoryLog, NodeLog, NodeName, Rule};
use crate::work::{Asker, Requester};
use mrol_map::map::MultiResolutionMap;
use mrol_store::{DataDir, MapFolder, OpeningProgress, Snapshot, StoreError, StoreSettings};

#[path = "../../../../../tests/support/simulated_disk.rs"]
#[expect(dead_code, unreachable_pub, reason = "of all that fails, here it is the power")]
pub(super) mod simulated;

pub(super) const NODES: usize = 3;
/// Bytes of a message: a change of many voxels takes several.
const PIECE_BYTES: usize = 400;

pub(super) struct Node {
    pub(super) name: NodeName,
    pub(super) disk: simulated::SimulatedDisk,
    /// None while it is down.
    pub(super) process: Option<Process>,
    /// What it said last: the claim that it had read, and its revision.
    pub(super) beat: Option<(Option<Uuid>, u64)>,
}

pub(super) struct Process {
    pub(super) worker: Worker,
    pub(super) map: Arc<MultiResolutionMap>,
    pub(super) folder: Arc<MapFolder>,
    pub(super) recent: Arc<RecentChanges>,
    /// Up to where its revisions were compared with the others'.
    pub(super) compared: u64,
}

impl Node {
    /// Starts its process on what its disk has; a new map of `base` where that is nothing.
    pub(super) fn start(
        &mut self,
        log: &Arc<Mutex<MemoryLog>>,
        base: &Snapshot,
        left_out: Option<Rule>,
        store: &StoreSettings,
    ) -> Result<(), StoreError> {
        let dir = DataDir::on(Arc::new(self.disk.clone()), Path::new("data"), store.clone()).unwrap();
        let progress = OpeningProgress::default();
        if dir.names().unwrap().is_empty() {
            drop(dir.create(&name(), base).unwrap());
        }
        let opened = dir.map(&name(), &progress)?;
        let (map, folder) = (Arc::new(opened.map), Arc::new(opened.folder));
        let recent = Arc::new(RecentChanges::new(map.revision(), opened.history, 0));
        let published = Published {
            announced: watch::Sender::new(map.revision()),
            recent: Arc::clone(&recent),
            lead: watch::Sender::new(Lead::Alone),
        };
        let member = Member::join(Arc::new(NodeLog(Arc::clone(log))), self.name.clone(), MAP);
        let mut worker = Worker::new(
            name(),
            Arc::clone(&map),
            Some(Arc::clone(&folder)),
            published,
            Arc::default(),
            Arc::default(),
            store,
        );
        worker.member = Some(member.without(left_out).with_pieces_of(PIECE_BYTES));
        self.process = Some(Process { worker, map, folder, recent, compared: 0 });
        Ok(())
    }
}

impl Process {
    pub(super) fn commit(&mut self, submissions: Vec<Submission>) -> Vec<Outcome> {
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

    pub(super) fn act(&mut self, act: SharedAct) -> Outcome {
        self.commit(vec![Submission::Shared(act)]).remove(0)
    }
}
