//! The way into a map: a queue of changes, and the thread that takes them out of it.

use std::sync::{Arc, OnceLock};

use tokio::sync::{oneshot, watch};

use super::stop::Stop;
use super::submission::{Outcome, Submission, Waiting};
use super::worker::{GROUP_MAX, Published, Worker};
use crate::error::{Reason, ServiceError};
use mrol_map::map::{MapName, MultiResolutionMap};
use mrol_map::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use mrol_map::sync::thread;
use mrol_map::util::{Durations, SharedDurations};
use mrol_store::{MapFolder, StoreSettings};

/// The way into a map. Dropping it ends the map's thread, after the changes that wait.
#[derive(Debug)]
pub(crate) struct CommitQueue {
    inbox: SyncSender<Waiting>,
    stopped: Arc<OnceLock<Stop>>,
    /// True once no other revision will come: those who wait for one hold the map, and so its thread.
    ended: watch::Sender<bool>,
    durations: Arc<SharedDurations>,
}

/// The thread of a map that is not there yet. It is started before anything is done on the disk, so that what was done
/// there never lacks a thread; dropped, it ends.
pub(crate) struct CommitThread(SyncSender<(Worker, Receiver<Waiting>)>);

impl CommitThread {
    /// Starts the thread of a map of that name.
    ///
    /// # Errors
    /// When the system has no thread left.
    pub(crate) fn start(name: &MapName) -> Result<Self, ServiceError> {
        let (begin, begun) = sync_channel::<(Worker, Receiver<Waiting>)>(1);
        let thread = thread::Builder::new().name(format!("mrol-commit-{name}"));
        let started = thread.spawn(move || {
            if let Ok((worker, waiting)) = begun.recv() {
                worker.run(&waiting);
            }
        });
        let no_threads = |e: std::io::Error| ServiceError::new(Reason::NoThreads, e.to_string());
        started.map_err(no_threads).map(|_| Self(begin))
    }
}

impl CommitQueue {
    /// Gives `thread` a map.
    pub(crate) fn begin(
        thread: CommitThread,
        name: MapName,
        map: Arc<MultiResolutionMap>,
        folder: Option<Arc<MapFolder>>,
        published: Published,
        settings: &StoreSettings,
    ) -> Self {
        let (inbox, waiting) = sync_channel(GROUP_MAX);
        let stopped = Arc::new(OnceLock::new());
        let durations = Arc::<SharedDurations>::default();
        let worker =
            Worker::new(name, map, folder, published, Arc::clone(&stopped), Arc::clone(&durations), settings);
        // It waits for just this.
        drop(thread.0.send((worker, waiting)));
        Self { inbox, stopped, ended: watch::Sender::new(false), durations }
    }

    /// Hands a change over; its outcome comes when it is visible, and with [`Durability::Always`] durable. Does not
    /// wait: the thread of a map whose disk hangs takes nothing from its queue, and who waited for a place in it would
    /// keep a thread from the other maps.
    ///
    /// # Errors
    /// `ResourceExhausted` where the queue is full.
    pub(crate) fn submit(&self, submission: Submission) -> Result<oneshot::Receiver<Outcome>, ServiceError> {
        let (answer, outcome) = oneshot::channel();
        match self.inbox.try_send(Waiting { submission, answer }) {
            // Where the thread is gone, so is the sender of the outcome.
            Ok(()) | Err(TrySendError::Disconnected(_)) => Ok(outcome),
            Err(TrySendError::Full(_)) => Err(ServiceError::overloaded(format!(
                "{GROUP_MAX} changes of this map wait for its disk already: try again"
            ))),
        }
    }

    /// How long groups of changes took to become durable and visible.
    pub(crate) fn durations(&self) -> Durations {
        self.durations.read()
    }

    /// Why the map takes no more changes.
    pub(crate) fn stopped(&self) -> Option<&Stop> {
        self.stopped.get()
    }

    /// The map is deleted: it takes no more changes.
    pub(crate) fn end(&self) {
        self.stopped.get_or_init(|| Stop::Deleted);
        self.ended.send_replace(true);
    }

    /// Waits until the map is deleted or replaced.
    pub(crate) async fn ended(&self) {
        // The sender is there as long as this is.
        drop(self.ended.subscribe().wait_for(|ended| *ended).await);
    }

    /// Another map takes its place: it takes no more changes here, and when this returns, none is on its way.
    pub(crate) fn end_replaced(&self) {
        self.stopped.get_or_init(|| Stop::Replaced);
        let (answer, behind_all) = oneshot::channel();
        let submission = Submission::Undecided(Box::new(|_, _| Ok(None)));
        // Waits for a place in the queue; where the thread is gone, so are its changes.
        if self.inbox.send(Waiting { submission, answer }).is_ok() {
            drop(behind_all.blocking_recv());
        }
        self.ended.send_replace(true);
    }
}
