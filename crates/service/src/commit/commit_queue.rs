//! The way into a map: a queue of changes, which a thread that is free takes out of it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock, Weak};

use tokio::sync::{oneshot, watch};

use super::commit_threads::{CommitThreads, Turn};
use super::lead::Lead;
use super::stop::Stop;
use super::submission::{Outcome, Submission, Waiting};
use super::turns::Turns;
use super::worker::{GROUP_MAX, Published, Worker};
use crate::error::ServiceError;
use crate::work::{Asker, Requester, Share, Shares};
use mrol_map::map::{MapName, MultiResolutionMap};
use mrol_map::sync::{Mutex, Rank};
use mrol_map::util::{Durations, SharedDurations};
use mrol_store::{MapFolder, StoreSettings};

/// Changes that wait for a map. Of one asker wait as many as places are left: half of them, which is one group, where
/// nobody else waits.
const PLACES: usize = 2 * GROUP_MAX;

/// The way into a map. Dropped, it takes nothing any more; the changes that wait are made.
#[derive(Debug)]
pub(crate) struct CommitQueue {
    threads: Arc<CommitThreads>,
    inbox: Arc<Inbox>,
    /// The places of changes that wait, of which nobody has all.
    places: Arc<Shares>,
    stopped: Arc<OnceLock<Stop>>,
    /// True once no other revision will come: those who wait for one hold the map, and so its queue.
    ended: watch::Sender<bool>,
    durations: Arc<SharedDurations>,
    lead: watch::Sender<Lead>,
}

/// The changes that wait, and the worker that makes them. One thread at a time has a turn.
struct Inbox {
    state: Mutex<State>,
    threads: Weak<CommitThreads>,
    this: Weak<Self>,
}

struct State {
    waiting: Turns,
    /// None while a thread works with it, once a defect ended it, and when all is done.
    worker: Option<Worker>,
    /// A turn is due, or under way.
    is_due: bool,
    /// A turn is asked for later, to sync.
    is_alarm_set: bool,
    is_closed: bool,
    /// A defect ended the worker: later changes are refused.
    is_broken: bool,
    /// Dropped when the worker is gone for good.
    at_work: Option<oneshot::Sender<()>>,
}

impl std::fmt::Debug for Inbox {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Inbox")
    }
}

impl CommitQueue {
    /// The way into `map`, whose changes `threads` make.
    pub(crate) fn begin(
        threads: &Arc<CommitThreads>,
        name: MapName,
        map: Arc<MultiResolutionMap>,
        folder: Option<Arc<MapFolder>>,
        published: Published,
        settings: &StoreSettings,
    ) -> Self {
        let stopped = Arc::new(OnceLock::new());
        let durations = Arc::<SharedDurations>::default();
        let lead = published.lead.clone();
        let worker =
            Worker::new(name, map, folder, published, Arc::clone(&stopped), Arc::clone(&durations), settings);
        let state = State {
            waiting: Turns::default(),
            worker: Some(worker),
            is_due: false,
            is_alarm_set: false,
            is_closed: false,
            is_broken: false,
            at_work: None,
        };
        let inbox = Arc::new_cyclic(|this| Inbox {
            state: Mutex::new(Rank::Brief, state),
            threads: Arc::downgrade(threads),
            this: Weak::clone(this),
        });
        Self {
            threads: Arc::clone(threads),
            inbox,
            places: Arc::new(Shares::new(PLACES)),
            stopped,
            ended: watch::Sender::new(false),
            durations,
            lead,
        }
    }

    /// Hands a change over; its outcome comes when it is visible, and with [`Durability::Always`] durable. Does not
    /// wait: from the queue of a map whose disk hangs nothing is taken, and who waited for a place in it would keep a
    /// thread from the other maps.
    ///
    /// # Errors
    /// `ResourceExhausted` where as many changes of the same asker wait as there are places left.
    pub(crate) fn submit(
        &self,
        requester: &Requester,
        submission: Submission,
    ) -> Result<oneshot::Receiver<Outcome>, ServiceError> {
        let place = self.places.take(&requester.asker).ok_or_else(|| full(&requester.asker))?;
        Ok(self.put(requester, submission, Some(place)))
    }

    /// Hands a change over, in a place of its own or in none.
    fn put(
        &self,
        requester: &Requester,
        submission: Submission,
        place: Option<Share>,
    ) -> oneshot::Receiver<Outcome> {
        let (answer, outcome) = oneshot::channel();
        let requester = requester.clone();
        let mut state = self.inbox.state.lock();
        // Where the worker is gone, so is the sender of the outcome.
        if !state.is_broken {
            state.waiting.push(Waiting { submission, answer, requester, _place: place });
            let was_due = std::mem::replace(&mut state.is_due, true);
            drop(state);
            match was_due {
                false => self.threads.schedule(Arc::clone(&self.inbox) as Arc<dyn Turn>),
                true => self.threads.relieve(),
            }
        }
        outcome
    }

    /// Takes nothing any more; the receiver hears when the changes that wait are made and synced, and the map's folder
    /// is not used any more.
    pub(crate) fn close(self) -> oneshot::Receiver<()> {
        let (at_work, done) = oneshot::channel();
        self.inbox.state.lock().at_work = Some(at_work);
        done
    }

    /// How long groups of changes took to become durable and visible.
    pub(crate) fn durations(&self) -> Durations {
        self.durations.read()
    }

    /// Why the map takes no more changes.
    pub(crate) fn stopped(&self) -> Option<&Stop> {
        self.stopped.get()
    }

    /// The map takes no changes before it has joined the log that other nodes read too.
    pub(crate) fn wait_for_log(&self) {
        self.lead.send_replace(Lead::NotJoined);
    }

    /// Who makes the changes of the map; the receiver hears when that is another.
    pub(crate) fn lead(&self) -> watch::Receiver<Lead> {
        self.lead.subscribe()
    }

    /// The map is gone from this server, for this reason: it takes no more changes.
    pub(crate) fn end(&self, stop: Stop) {
        self.stopped.get_or_init(|| stop);
        self.ended.send_replace(true);
    }

    /// Waits until the map is deleted, replaced or renamed, or its copy dropped.
    pub(crate) async fn ended(&self) {
        // The sender is there as long as this is.
        drop(self.ended.subscribe().wait_for(|ended| *ended).await);
    }

    /// Another map takes its place: it takes no more changes here, and when this returns, none is on its way.
    pub(crate) fn end_replaced(&self) {
        self.end_as(Stop::Replaced);
    }

    /// It has another name: it takes no more changes under this one, and when this returns, none is on its way.
    pub(crate) fn end_renamed(&self) {
        self.end_as(Stop::Renamed);
    }

    fn end_as(&self, stop: Stop) {
        self.stopped.get_or_init(|| stop);
        let nothing = Submission::Undecided(Box::new(|_, _| Ok(None)));
        // What is still to have its turn is refused from now on. It takes no place; where the worker is gone, so are
        // its changes.
        let requester = Requester::from(&Asker::default());
        drop(self.put(&requester, nothing, None).blocking_recv());
        self.ended.send_replace(true);
    }
}

impl Drop for CommitQueue {
    fn drop(&mut self) {
        let mut state = self.inbox.state.lock();
        state.is_closed = true;
        let was_due = std::mem::replace(&mut state.is_due, true);
        drop(state);
        // What was made is synced, and the map given back, on a thread that may wait for a disk.
        if !was_due {
            self.threads.schedule(Arc::clone(&self.inbox) as Arc<dyn Turn>);
        }
    }
}

impl Turn for Inbox {
    fn take(&self) -> bool {
        let mut state = self.state.lock();
        let Some(worker) = state.worker.take() else {
            state.is_due = false;
            drop(state.at_work.take());
            return false;
        };
        let waiting = state.waiting.group(GROUP_MAX);
        drop(state);
        let commit = move || {
            let mut worker = worker;
            worker.commit(waiting);
            worker.sync_if_due();
            worker
        };
        // A defect ends the map's changes, as those who wait for them hear, and no thread.
        match catch_unwind(AssertUnwindSafe(commit)) {
            Ok(worker) => self.put_back(worker),
            Err(_) => self.give_up(),
        }
    }

    fn wake(self: Arc<Self>, threads: &CommitThreads) {
        let mut state = self.state.lock();
        state.is_alarm_set = false;
        let was_due = std::mem::replace(&mut state.is_due, true);
        drop(state);
        if !was_due {
            threads.schedule(self);
        }
    }
}

impl Inbox {
    /// Ends a turn; true where another is due.
    fn put_back(&self, mut worker: Worker) -> bool {
        let mut state = self.state.lock();
        if !state.waiting.is_empty() {
            state.worker = Some(worker);
            return true;
        }
        if state.is_closed {
            let at_work = state.at_work.take();
            drop(state);
            worker.sync();
            drop(worker);
            drop(at_work);
            return false;
        }
        let alarm = worker.due_at().filter(|_| !state.is_alarm_set);
        state.is_alarm_set |= alarm.is_some();
        state.worker = Some(worker);
        state.is_due = false;
        drop(state);
        if let (Some(at), Some(threads)) = (alarm, self.threads.upgrade()) {
            let this: Weak<dyn Turn> = self.this.clone();
            if threads.wake_at(at, this).is_err() {
                self.sync_now();
            }
        }
        false
    }

    /// Syncs at once what nobody would wake this for later.
    fn sync_now(&self) {
        let mut state = self.state.lock();
        state.is_alarm_set = false;
        if state.is_due {
            return;
        }
        let Some(mut worker) = state.worker.take() else { return };
        state.is_due = true;
        drop(state);
        worker.sync();
        if self.put_back(worker)
            && let (Some(this), Some(threads)) = (self.this.upgrade(), self.threads.upgrade())
        {
            threads.schedule(this);
        }
    }

    /// Lets go of the changes that wait, whose callers hear of it.
    fn give_up(&self) -> bool {
        let mut state = self.state.lock();
        (state.is_broken, state.is_due) = (true, false);
        let gone = (std::mem::take(&mut state.waiting), state.at_work.take());
        drop(state);
        drop(gone);
        false
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
        let hosted = service.map(&map).await.unwrap();
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
        let hosted = service.map(&map).await.unwrap();
        let busy = hosted.commit_queue.places.taken();
        let all_wait = async |scans: u64| {
            while hosted.commit_queue.places.taken() < busy + scans as usize {
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
        let hosted = service.map(&map).await.unwrap();
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
