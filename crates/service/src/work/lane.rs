//! Bounded threads for work that uses the CPU, away from the async runtime.
//!
//! Jobs wait in the futures of those who want their answers: whoever gives up takes the job along, with all that it
//! holds in memory and its place among those that wait. A job in hand learns of it by its [`StopSignal`], by which it
//! also gives way to others between its parts.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::oneshot;

use super::asker::{Asker, Requester};
use super::background::Background;
use super::failures::Failures;
use super::fair_queue::{FairQueue, HeldThread};
use super::pause::{PART, PART_OF_FAILING, Pauses};
use super::precedence::Precedence;
use super::shares::Shares;
use super::threads::Threads;
use crate::error::{Reason, ServiceError};
use mrol_map::util::{Durations, SharedDurations, StopSignal};

/// What a lane is started with.
#[derive(Debug, Clone, Copy)]
pub(super) struct LaneSettings {
    /// What it and its threads are called.
    pub(super) name: &'static str,
    /// Threads that have jobs at once.
    pub(super) threads: usize,
    /// Jobs that may wait for a thread.
    pub(super) waiting_max: usize,
    /// Jobs that may have given way at once: each keeps its memory, and a thread of the system.
    pub(super) paused_max: usize,
}

/// A name, a fair queue, and a number of threads of one priority.
#[derive(Debug)]
pub(crate) struct Lane {
    name: &'static str,
    threads: Arc<Threads>,
    /// The queue for threads that have no job.
    queue: FairQueue,
    /// Callers that wait for their robot or their map to be free.
    waiting_for_locks: Arc<Shares>,
    jobs_waiting_max: usize,
    /// What its jobs take precedence as, over other lanes.
    precedence: Option<Precedence>,
    /// Where its jobs are such that others are not to wait for.
    background: Option<Background>,
    counts: Arc<Counts>,
    failures: Failures,
}

/// Numbers of jobs, since the start.
#[derive(Debug, Default)]
struct Counts {
    begun: AtomicU64,
    cancelled: AtomicU64,
    waits: SharedDurations,
}

/// What became of the jobs of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LaneUse {
    /// The lane's: `read`, `query`, `message`, `mapping`, `long_mapping`, `alignment`, `localization`, `recovery`,
    /// `undo`, `map_file`, `watch`, `observers`, `blocks` or `planning`.
    pub name: &'static str,
    /// Jobs that wait for a thread.
    pub waiting: usize,
    /// Jobs in hand.
    pub running: usize,
    /// Jobs that a thread took in hand, since the start.
    pub begun: u64,
    /// Jobs that were cancelled since the start: their callers went before the answer.
    pub cancelled: u64,
    /// How long jobs waited for a thread, since the start.
    pub waits: Durations,
}

impl Lane {
    /// Starts the threads.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn start(settings: LaneSettings) -> Result<Self, ServiceError> {
        let LaneSettings { name, threads, waiting_max, paused_max } = settings;
        Ok(Self {
            name,
            threads: Threads::start(name, threads)?.into(),
            queue: FairQueue::new(threads, waiting_max, paused_max),
            waiting_for_locks: Arc::new(Shares::new(waiting_max)),
            jobs_waiting_max: waiting_max,
            precedence: None,
            background: None,
            counts: Arc::default(),
            failures: Failures::default(),
        })
    }

    /// The same lane, whose jobs have precedence over others.
    #[must_use]
    pub(super) fn taking(self, precedence: &Precedence) -> Self {
        Self { precedence: Some(precedence.clone()), ..self }
    }

    /// The same lane, which uses at most `threads` of its threads while others have precedence.
    #[must_use]
    pub(super) fn behind(self, precedence: &Precedence, threads: usize) -> Self {
        let queue = self.queue.giving_precedence(precedence.clone(), threads);
        Self { queue, ..self }
    }

    /// The same lane, whose jobs use the cores that others leave.
    #[must_use]
    pub(super) fn in_background(self, background: &Background) -> Self {
        Self { background: Some(background.clone()), ..self }
    }

    /// Waits for `lock`, before which a job makes no sense. Those that wait are as many as jobs may, and of one asker
    /// as many as there are places left.
    ///
    /// # Errors
    /// `ResourceExhausted` at once when others have the lock and too many wait.
    pub(crate) async fn once_free<T>(
        &self,
        asker: &Asker,
        lock: impl Future<Output = T>,
    ) -> Result<T, ServiceError> {
        let mut lock = pin!(lock);
        tokio::select! {
            biased;
            lock = &mut lock => return Ok(lock),
            () = std::future::ready(()) => {}
        }
        let _place = self.waiting_for_locks.take(asker).ok_or_else(|| self.full())?;
        Ok(lock.await)
    }

    fn full(&self) -> ServiceError {
        let most = self.jobs_waiting_max;
        ServiceError::overloaded(format!("jobs_waiting_max is {most}: all places are taken, try again"))
    }

    /// Runs `job` on a thread of the lane in the requester's turn; not at all where the caller does not wait for it.
    ///
    /// # Errors
    /// `ResourceExhausted` when the queue is full of those who ask no more than the requester; `Internal` when the job
    /// panicked.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        requester: impl Into<Requester>,
        job: impl FnOnce(StopSignal<'_>) -> T + Send + 'static,
    ) -> Result<T, ServiceError> {
        let thread = self.thread(requester).await?;
        self.run_on(thread, job).await
    }

    /// Waits for a thread of the lane.
    ///
    /// # Errors
    /// `ResourceExhausted` as for [`Lane::run`].
    pub(crate) async fn thread(&self, requester: impl Into<Requester>) -> Result<FreeThread, ServiceError> {
        let requester = requester.into();
        let part = if self.failures.is_failing(&requester) { PART_OF_FAILING } else { PART };
        let mut unanswered = Unanswered { counts: Arc::clone(&self.counts), answered: false };
        let begin = Instant::now();
        let Ok(thread) = self.queue.take(&requester).await else {
            unanswered.answered = true;
            return Err(self.full());
        };
        self.counts.waits.record(begin.elapsed());
        Ok(FreeThread { thread, part, unanswered })
    }

    /// Runs `job` on a thread that was waited for.
    ///
    /// # Errors
    /// `Internal` when the job panicked.
    pub(crate) async fn run_on<T: Send + 'static>(
        &self,
        thread: FreeThread,
        job: impl FnOnce(StopSignal<'_>) -> T + Send + 'static,
    ) -> Result<T, ServiceError> {
        let (answer, answered) = oneshot::channel();
        let span = tracing::Span::current();
        let (threads, queue) = (Arc::downgrade(&self.threads), self.queue.clone());
        let at_work = self.precedence.as_ref().map(Precedence::begin);
        let in_background = self.background.as_ref().map(Background::begin);
        self.threads.run(move || {
            let FreeThread { thread, part, unanswered } = thread;
            // The lane is gone, and whoever waited with it.
            let Some(threads) = threads.upgrade() else { return };
            unanswered.counts.begun.fetch_add(1, Ordering::Relaxed);
            let pauses = Pauses {
                queue: &queue,
                threads: &threads,
                part,
                held: RefCell::new(thread),
                in_background: RefCell::new(in_background),
                part_begun: Cell::new(Instant::now()),
                paused_for: Cell::default(),
            };
            let caller_gone = || answer.is_closed();
            let stop = StopSignal::when(&caller_gone).giving_way_by(&pauses);
            let done = catch_unwind(AssertUnwindSafe(|| span.in_scope(|| job(stop))));
            // A caller that is answered may ask again at once.
            drop(pauses.held);
            drop(pauses.in_background);
            drop(at_work);
            drop(threads);
            // A panic drops `answer`, which the caller is told; the thread lives on.
            if done.map_or(true, |result| answer.send(result).is_ok()) {
                unanswered.note_answer();
            }
        });
        answered.await.map_err(|_| failed())
    }

    /// True of a requester whose work keeps failing, as was noted.
    pub(crate) fn is_failing(&self, requester: &Requester) -> bool {
        self.failures.is_failing(requester)
    }

    /// Notes whether the work of a requester came to something: what keeps failing takes shorter parts of the turns.
    pub(crate) fn note(&self, requester: &Requester, succeeded: bool) {
        self.failures.note(requester, succeeded);
    }

    pub(super) fn in_use(&self) -> LaneUse {
        let (running, waiting) = self.queue.running_and_waiting();
        LaneUse {
            name: self.name,
            waiting,
            running,
            begun: self.counts.begun.load(Ordering::Relaxed),
            cancelled: self.counts.cancelled.load(Ordering::Relaxed),
            waits: self.counts.waits.read(),
        }
    }

    /// True while a job waits for a thread.
    pub(crate) fn is_wanted(&self) -> bool {
        self.queue.running_and_waiting().1 > 0
    }
}

/// A thread of a lane that has no job yet, and waits for one until this is dropped.
#[derive(Debug)]
pub(crate) struct FreeThread {
    thread: HeldThread,
    part: Duration,
    unanswered: Unanswered,
}

/// A job without an answer: cancelled where it is dropped as such.
#[derive(Debug)]
struct Unanswered {
    counts: Arc<Counts>,
    answered: bool,
}

impl Unanswered {
    fn note_answer(mut self) {
        self.answered = true;
    }
}

impl Drop for Unanswered {
    fn drop(&mut self) {
        if !self.answered {
            self.counts.cancelled.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn failed() -> ServiceError {
    ServiceError::new(Reason::JobPanicked, "the job failed by a defect of the server")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use tokio::task::JoinHandle;

    fn settings(waiting_max: usize) -> LaneSettings {
        LaneSettings { name: "test", threads: 1, waiting_max, paused_max: 4 }
    }

    fn lane(waiting_max: usize) -> Arc<Lane> {
        Arc::new(Lane::start(settings(waiting_max)).unwrap())
    }

    fn who() -> Asker {
        Asker::default()
    }

    fn spawned<T: Send + 'static>(
        lane: &Arc<Lane>,
        job: impl FnOnce(StopSignal<'_>) -> T + Send + 'static,
    ) -> JoinHandle<Result<T, ServiceError>> {
        let lane = Arc::clone(lane);
        tokio::spawn(async move { lane.run(&who(), job).await })
    }

    /// Keeps the only thread until it is told to go on.
    async fn kept_busy(lane: &Arc<Lane>) -> (Sender<()>, JoinHandle<Result<(), ServiceError>>) {
        let (release, released): (_, Receiver<()>) = channel();
        let running = spawned(lane, move |_| released.recv().unwrap());
        until(|| lane.in_use().running == 1).await;
        (release, running)
    }

    async fn until(happened: impl Fn() -> bool) {
        while !happened() {
            tokio::task::yield_now().await;
        }
    }

    #[tokio::test]
    async fn a_full_queue_refuses_at_once_and_recovers() {
        let lane = lane(1);
        let (release, running) = kept_busy(&lane).await;
        let waiting = spawned(&lane, |_| 2);
        until(|| lane.in_use().waiting == 1).await;
        let refused = lane.run(&who(), |_| 3).await.unwrap_err();
        assert_eq!(refused.reason, Reason::Overloaded);
        assert!(refused.message.contains("jobs_waiting_max is 1"));
        release.send(()).unwrap();
        running.await.unwrap().unwrap();
        assert_eq!(waiting.await.unwrap().unwrap(), 2);
        assert_eq!(lane.run(&who(), |_| 4).await.unwrap(), 4);
        let LaneUse { waiting, running, begun, cancelled, .. } = lane.in_use();
        assert_eq!((waiting, running, begun, cancelled), (0, 0, 3, 0));
    }

    #[tokio::test]
    async fn no_more_wait_for_a_turn_than_may_and_whoever_finds_it_free_does_not_wait() {
        let (lane, lock) = (lane(1), Arc::new(tokio::sync::Mutex::new(())));
        let held = lane.once_free(&who(), Arc::clone(&lock).lock_owned()).await.unwrap();
        let waiting = tokio::spawn({
            let (lane, turn) = (Arc::clone(&lane), Arc::clone(&lock).lock_owned());
            async move { lane.once_free(&who(), turn).await.map(drop) }
        });
        until(|| lane.waiting_for_locks.taken() == 1).await;
        let refused = lane.once_free(&who(), Arc::clone(&lock).lock_owned()).await.unwrap_err();
        assert!(refused.message.contains("jobs_waiting_max is 1"), "{}", refused.message);
        drop(held);
        waiting.await.unwrap().unwrap();
        drop(lane.once_free(&who(), lock.lock_owned()).await.unwrap());
        assert_eq!(lane.waiting_for_locks.taken(), 0);
    }

    #[tokio::test]
    async fn a_job_that_nobody_waits_for_goes_at_once_with_its_place_and_what_it_holds() {
        let lane = lane(1);
        let (release, running) = kept_busy(&lane).await;
        let held = Arc::new(());
        let gone = spawned(&lane, {
            let held = Arc::clone(&held);
            move |_| drop(held)
        });
        until(|| lane.in_use().waiting == 1).await;
        gone.abort();
        assert!(gone.await.unwrap_err().is_cancelled());
        assert_eq!((lane.in_use().waiting, lane.in_use().cancelled), (0, 1));
        assert_eq!(Arc::strong_count(&held), 1);
        release.send(()).unwrap();
        running.await.unwrap().unwrap();
        // Its turn would have come by now.
        lane.run(&who(), |_| ()).await.unwrap();
        assert_eq!(lane.in_use().begun, 2);
    }

    #[tokio::test]
    async fn a_job_in_hand_learns_that_its_caller_has_gone() {
        let lane = lane(0);
        let gone = spawned(&lane, |stop| {
            while !stop.is_stopped() {
                std::thread::yield_now();
            }
        });
        until(|| lane.in_use().running == 1).await;
        gone.abort();
        until(|| lane.in_use().cancelled == 1).await;
        assert_eq!(lane.in_use().running, 0);
    }

    #[tokio::test]
    async fn long_work_gives_way_to_others_between_its_parts_and_goes_on() {
        let lane = lane(2);
        let (other_is_done, parts) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
        let long = spawned(&lane, {
            let (other_is_done, parts) = (Arc::clone(&other_is_done), Arc::clone(&parts));
            move |stop| {
                // Where nothing gives way, that ends all the same.
                for _ in 0..5000 {
                    parts.fetch_add(1, Ordering::SeqCst);
                    std::thread::sleep(Duration::from_millis(1));
                    stop.give_way();
                    if other_is_done.load(Ordering::SeqCst) > 0 {
                        return stop.paused_for() > Duration::ZERO;
                    }
                }
                false
            }
        });
        until(|| parts.load(Ordering::SeqCst) > 0).await;
        let (who, done) = (Asker::with_key("other"), other_is_done);
        let other = lane.run(&who, move |_| done.fetch_add(1, Ordering::SeqCst));
        assert_eq!(other.await.unwrap(), 0);
        assert!(long.await.unwrap().unwrap());
        let LaneUse { waiting, running, begun, .. } = lane.in_use();
        assert_eq!((waiting, running, begun), (0, 0, 2));
    }

    #[tokio::test]
    async fn a_job_that_panics_is_an_error_of_its_own() {
        let lane = lane(1);
        let failed = lane.run(&who(), |_| panic!("a defect")).await.map(|(): ()| ()).unwrap_err();
        assert_eq!(failed.reason, Reason::JobPanicked);
        assert_eq!(lane.run(&who(), |_| 1).await.unwrap(), 1);
    }
}
