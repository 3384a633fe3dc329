//! The way into a map: a queue of changes, and the thread that takes them out of it.

use std::sync::{Arc, OnceLock};

use tokio::sync::{oneshot, watch};

use super::stop::Stop;
use super::submission::{Outcome, Submission, Waiting};
use super::worker::{GROUP_MAX, Published, Worker};
use crate::error::{Reason, ServiceError};
use crate::work::{Asker, Requester, Shares};
use mrol_map::map::{MapName, MultiResolutionMap};
use mrol_map::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use mrol_map::sync::thread;
use mrol_map::util::{Durations, SharedDurations};
use mrol_store::{MapFolder, StoreSettings};

/// Changes that wait for a map. Of one asker wait as many as places are left: half of them, which is one group, where
/// nobody else waits.
const PLACES: usize = 2 * GROUP_MAX;

/// The way into a map. Dropping it ends the map's thread, after the changes that wait.
#[derive(Debug)]
pub(crate) struct CommitQueue {
    inbox: SyncSender<Waiting>,
    /// The places of changes that wait, of which nobody has all.
    places: Arc<Shares>,
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
        let (inbox, waiting) = sync_channel(PLACES);
        let stopped = Arc::new(OnceLock::new());
        let durations = Arc::<SharedDurations>::default();
        let worker =
            Worker::new(name, map, folder, published, Arc::clone(&stopped), Arc::clone(&durations), settings);
        // It waits for just this.
        drop(thread.0.send((worker, waiting)));
        Self {
            inbox,
            places: Arc::new(Shares::new(PLACES)),
            stopped,
            ended: watch::Sender::new(false),
            durations,
        }
    }

    /// Hands a change over; its outcome comes when it is visible, and with [`Durability::Always`] durable. Does not
    /// wait: the thread of a map whose disk hangs takes nothing from its queue, and who waited for a place in it would
    /// keep a thread from the other maps.
    ///
    /// # Errors
    /// `ResourceExhausted` where as many changes of the same asker wait as there are places left.
    pub(crate) fn submit(
        &self,
        requester: &Requester,
        submission: Submission,
    ) -> Result<oneshot::Receiver<Outcome>, ServiceError> {
        let (answer, outcome) = oneshot::channel();
        let place = self.places.take(&requester.asker).ok_or_else(|| full(&requester.asker))?;
        let requester = requester.clone();
        match self.inbox.try_send(Waiting { submission, answer, requester, _place: Some(place) }) {
            // Where the thread is gone, so is the sender of the outcome.
            Ok(()) | Err(TrySendError::Disconnected(_)) => Ok(outcome),
            Err(TrySendError::Full(waiting)) => Err(full(&waiting.requester.asker)),
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
        // What is still to have its turn is refused from now on. Waits for a place in the queue; where the thread is gone,
        // so are its changes.
        let requester = Requester::from(&Asker::default());
        if self.inbox.send(Waiting { submission, answer, requester, _place: None }).is_ok() {
            drop(behind_all.blocking_recv());
        }
        self.ended.send_replace(true);
    }
}

fn full(asker: &Asker) -> ServiceError {
    ServiceError::overloaded(format!(
        "as many changes of this map by {asker} wait for its disk as there are places left for others, of {PLACES}: try again"
    ))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use tokio::task::JoinSet;

    use super::*;
    use crate::map_service::MapService;
    use crate::request::ScanRequest;
    use crate::settings::ServiceSettings;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::{MapSettings, RobotName};
    use mrol_map::mapping::Guess;
    use mrol_store::OpeningProgress;

    /// A service with a map whose thread is busy until the sender is dropped.
    async fn with_busy_map(settings: ServiceSettings) -> (MapService, MapName, mpsc::Sender<()>) {
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        let map = MapName::new("shared").unwrap();
        service.create_map(map.clone(), MapSettings::new(0.1, 1)).await.unwrap();
        let (hold, held) = mpsc::channel();
        let (begin, begun) = oneshot::channel();
        let busy = Submission::Undecided(Box::new(move |_, _| {
            let _ = begin.send(());
            let _ = held.recv();
            Ok(None)
        }));
        let hosted = service.map(&map).unwrap();
        drop(hosted.commit_queue.submit(&Requester::from(&Asker::default()), busy).unwrap());
        begun.await.unwrap();
        (service, map, hold)
    }

    #[tokio::test]
    async fn a_key_with_many_robots_keeps_another_key_waiting_for_no_more_than_two_commits() {
        const MANY: u64 = 20;
        let (service, map, hold) = with_busy_map(ServiceSettings::default()).await;
        let mut revisions = JoinSet::new();
        let mut send = |key: &'static str, n: u64| {
            let (service, map) = (service.clone().asked_by(Asker::with_key(key)), map.clone());
            let robot = RobotName::new(&format!("{key}{n}")).unwrap();
            let points = vec![Point::new(n as f32 + 0.05, 0.05, 0.05)].into();
            let scan = ScanRequest {
                guess: Guess::Pose(Pose::identity()),
                at_guess: true,
                ..ScanRequest::new(robot, points)
            };
            revisions
                .spawn(async move { (key, service.insert_scan(&map, scan).await.unwrap().version.revision) });
        };
        let all_wait = async |scans: u64| {
            let at_rest = || service.lanes().into_iter().find(|lane| lane.name == "mapping").unwrap();
            while at_rest().begun < scans || at_rest().running > 0 {
                tokio::task::yield_now().await;
            }
        };
        (0..MANY).for_each(|n| send("many", n));
        all_wait(MANY).await;
        send("one", MANY);
        all_wait(MANY + 1).await;
        drop(hold);
        let told = revisions.join_all().await;
        let of_one = told.iter().find(|(key, _)| *key == "one").unwrap().1;
        assert!(of_one <= 3, "{of_one} of {}", told.len());
    }

    #[tokio::test]
    async fn where_one_asker_has_half_of_the_places_another_still_finds_one() {
        let (service, map, _hold) = with_busy_map(ServiceSettings::default()).await;
        let hosted = service.map(&map).unwrap();
        let submit = |asker: &str| {
            let nothing = Submission::Undecided(Box::new(|_, _| Ok(None)));
            hosted.commit_queue.submit(&Requester::from(&Asker::with_key(asker)), nothing)
        };
        let of_many = std::iter::from_fn(|| submit("many").ok()).count();
        assert_eq!(of_many, GROUP_MAX);
        let refused = submit("many").unwrap_err();
        assert!(refused.message.contains("key many"), "{}", refused.message);
        submit("one").unwrap();
    }
}
