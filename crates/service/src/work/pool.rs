//! Bounded threads for work that uses the CPU, away from the async runtime.
//!
//! Jobs wait in the futures of those who want their answers: whoever gives up takes the job along, with all that it
//! holds in memory and its place among those that wait. A job in hand learns of it by its [`StopSignal`].

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

use super::asker::Asker;
use super::fair_queue::{HeldThread, ThreadQueue};
use crate::error::{Reason, ServiceError};
use mrol_map::util::{Durations, SharedDurations, StopSignal};

/// How nice threads are to those of other pools: they get a tenth of a core that both want.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;
/// The lowest priority that there is.
#[cfg(target_os = "linux")]
const NICEST: i32 = 19;

/// A fixed number of threads and a bounded queue before them.
#[derive(Debug)]
pub(crate) struct Pool {
    name: &'static str,
    threads: rayon::ThreadPool,
    /// One permit for each job that runs or waits.
    places: Arc<Semaphore>,
    /// Who gets a thread that has no job.
    queue: ThreadQueue,
    /// One permit for each caller that waits for the turn of its map or robot.
    turns: Semaphore,
    jobs_waiting_max: usize,
    counts: Arc<Counts>,
}

/// Numbers of jobs, since the start.
#[derive(Debug, Default)]
struct Counts {
    begun: AtomicU64,
    cancelled: AtomicU64,
    waits: SharedDurations,
}

/// What became of the jobs of a pool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PoolUse {
    /// The pool's: `query`, `mapping`, `long_mapping`, `alignment`, `localization`, `recovery`, `undo`, `map_file`,
    /// `watch`, `observers`, `blocks` or `planning`.
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

impl Pool {
    /// `threads` threads (0 = one a core), with at most `jobs_waiting_max` jobs waiting for them.
    pub(super) fn new(
        name: &'static str,
        threads: usize,
        jobs_waiting_max: usize,
    ) -> Result<Self, ServiceError> {
        Self::started(name, threads, jobs_waiting_max, |_| ())
    }

    /// As many threads as half of those of `other`, one at least, which give way to those of other pools.
    pub(super) fn beside(
        name: &'static str,
        other: &Self,
        jobs_waiting_max: usize,
    ) -> Result<Self, ServiceError> {
        let threads = (other.threads.current_num_threads() / 2).max(1);
        Self::started(name, threads, jobs_waiting_max, |_| give_way())
    }

    fn started(
        name: &'static str,
        threads: usize,
        jobs_waiting_max: usize,
        begin: impl Fn(usize) + Send + Sync + 'static,
    ) -> Result<Self, ServiceError> {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(move |i| format!("mrol-{name}-{i}"))
            .start_handler(begin)
            .build()
            .map_err(|e| ServiceError::new(Reason::NoThreads, e.to_string()))?;
        let free = threads.current_num_threads();
        Ok(Self {
            name,
            threads,
            places: Semaphore::new(free + jobs_waiting_max).into(),
            queue: ThreadQueue::new(free),
            turns: Semaphore::new(jobs_waiting_max),
            jobs_waiting_max,
            counts: Arc::default(),
        })
    }

    /// Waits for `turn`, before which a job makes no sense; those that wait are as many as jobs may.
    ///
    /// # Errors
    /// `ResourceExhausted` at once when others have the turn and too many wait.
    pub(crate) async fn in_turn<T>(&self, turn: impl Future<Output = T>) -> Result<T, ServiceError> {
        let mut turn = pin!(turn);
        tokio::select! {
            biased;
            turn = &mut turn => return Ok(turn),
            () = std::future::ready(()) => {}
        }
        let _place = self.turns.try_acquire().map_err(|_| self.full())?;
        Ok(turn.await)
    }

    fn full(&self) -> ServiceError {
        let most = self.jobs_waiting_max;
        ServiceError::overloaded(format!("jobs_waiting_max is {most}: all places are taken, try again"))
    }

    /// Runs `job` on a thread of the pool, first come first served; not at all where the caller does not wait for its
    /// turn.
    ///
    /// # Errors
    /// `ResourceExhausted` at once when the queue is full; `Internal` when the job panicked.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        job: impl FnOnce(StopSignal<'_>) -> T + Send + 'static,
    ) -> Result<T, ServiceError> {
        self.run_for(&Asker::default(), job).await
    }

    /// As [`Pool::run`], where callers take turns.
    ///
    /// # Errors
    /// As there.
    pub(crate) async fn run_for<T: Send + 'static>(
        &self,
        asker: &Asker,
        job: impl FnOnce(StopSignal<'_>) -> T + Send + 'static,
    ) -> Result<T, ServiceError> {
        let thread = self.thread_for(asker).await?;
        self.run_on(thread, job).await
    }

    /// Waits for a thread of the pool, first come first served.
    ///
    /// # Errors
    /// `ResourceExhausted` at once when the queue is full.
    pub(crate) async fn thread(&self) -> Result<FreeThread, ServiceError> {
        self.thread_for(&Asker::default()).await
    }

    async fn thread_for(&self, asker: &Asker) -> Result<FreeThread, ServiceError> {
        let place = Arc::clone(&self.places).try_acquire_owned().map_err(|_| self.full())?;
        let unanswered = Unanswered { counts: Arc::clone(&self.counts), answered: false };
        let begin = Instant::now();
        let thread = self.queue.take(asker).await;
        self.counts.waits.record(begin.elapsed());
        Ok(FreeThread { _place: place, _thread: thread, unanswered })
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
        self.threads.spawn(move || {
            let FreeThread { _place: place, _thread: thread, unanswered } = thread;
            unanswered.counts.begun.fetch_add(1, Ordering::Relaxed);
            let caller_gone = || answer.is_closed();
            let job = AssertUnwindSafe(|| span.in_scope(|| job(StopSignal::when(&caller_gone))));
            let done = catch_unwind(job);
            // Who is answered may ask again at once.
            drop((place, thread));
            // A panic drops `answer`, which the caller is told; the pool's thread lives on.
            if done.map_or(true, |result| answer.send(result).is_ok()) {
                unanswered.note_answer();
            }
        });
        answered.await.map_err(|_| failed())
    }

    /// True while a job waits for a thread.
    pub(crate) fn is_wanted(&self) -> bool {
        self.in_use().waiting > 0
    }

    pub(super) fn in_use(&self) -> PoolUse {
        let running = self.threads.current_num_threads() - self.queue.free();
        let all =
            self.threads.current_num_threads() + self.jobs_waiting_max - self.places.available_permits();
        PoolUse {
            name: self.name,
            waiting: all.saturating_sub(running),
            running,
            begun: self.counts.begun.load(Ordering::Relaxed),
            cancelled: self.counts.cancelled.load(Ordering::Relaxed),
            waits: self.counts.waits.read(),
        }
    }
}

/// A thread of a pool that has no job yet, and waits for one until this is dropped.
#[derive(Debug)]
pub(crate) struct FreeThread {
    _place: OwnedSemaphorePermit,
    _thread: HeldThread,
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

/// Lowers the priority of this thread. Where the system does not let it, it is as the others are.
#[cfg(target_os = "linux")]
fn give_way() {
    use rustix::process::{getpriority_process, setpriority_process};

    // On Linux a thread has a priority of its own.
    let lowered =
        getpriority_process(None).and_then(|nice| setpriority_process(None, (nice + NICENESS).min(NICEST)));
    if let Err(error) = lowered {
        tracing::debug!(%error, "the priority of a thread cannot be lowered");
    }
}

/// Elsewhere it would be the priority of the whole server.
#[cfg(not(all(target_os = "linux")))]
fn give_way() {}

fn failed() -> ServiceError {
    ServiceError::new(Reason::JobPanicked, "the job failed by a defect of the server")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use tokio::task::JoinHandle;

    fn pool(jobs_waiting_max: usize) -> Arc<Pool> {
        Arc::new(Pool::new("test", 1, jobs_waiting_max).unwrap())
    }

    fn spawned<T: Send + 'static>(
        pool: &Arc<Pool>,
        job: impl FnOnce(StopSignal<'_>) -> T + Send + 'static,
    ) -> JoinHandle<Result<T, ServiceError>> {
        let pool = Arc::clone(pool);
        tokio::spawn(async move { pool.run(job).await })
    }

    /// Keeps the only thread until it is told to go on.
    async fn kept_busy(pool: &Arc<Pool>) -> (Sender<()>, JoinHandle<Result<(), ServiceError>>) {
        let (release, released): (_, Receiver<()>) = channel();
        let running = spawned(pool, move |_| released.recv().unwrap());
        until(|| pool.in_use().running == 1).await;
        (release, running)
    }

    async fn until(happened: impl Fn() -> bool) {
        while !happened() {
            tokio::task::yield_now().await;
        }
    }

    #[tokio::test]
    async fn a_full_queue_refuses_at_once_and_recovers() {
        let pool = pool(1);
        let (release, running) = kept_busy(&pool).await;
        let waiting = spawned(&pool, |_| 2);
        until(|| pool.in_use().waiting == 1).await;
        let refused = pool.run(|_| 3).await.unwrap_err();
        assert_eq!(refused.reason, Reason::Overloaded);
        assert!(refused.message.contains("jobs_waiting_max is 1"));
        release.send(()).unwrap();
        running.await.unwrap().unwrap();
        assert_eq!(waiting.await.unwrap().unwrap(), 2);
        assert_eq!(pool.run(|_| 4).await.unwrap(), 4);
        let PoolUse { waiting, running, begun, cancelled, .. } = pool.in_use();
        assert_eq!((waiting, running, begun, cancelled), (0, 0, 3, 0));
    }

    #[tokio::test]
    async fn no_more_wait_for_a_turn_than_may_and_whoever_finds_it_free_does_not_wait() {
        let (pool, lock) = (pool(1), Arc::new(tokio::sync::Mutex::new(())));
        let held = pool.in_turn(Arc::clone(&lock).lock_owned()).await.unwrap();
        let waiting = tokio::spawn({
            let (pool, turn) = (Arc::clone(&pool), Arc::clone(&lock).lock_owned());
            async move { pool.in_turn(turn).await.map(drop) }
        });
        until(|| pool.turns.available_permits() == 0).await;
        let refused = pool.in_turn(Arc::clone(&lock).lock_owned()).await.unwrap_err();
        assert!(refused.message.contains("jobs_waiting_max is 1"), "{}", refused.message);
        drop(held);
        waiting.await.unwrap().unwrap();
        drop(pool.in_turn(lock.lock_owned()).await.unwrap());
        assert_eq!(pool.turns.available_permits(), 1);
    }

    #[tokio::test]
    async fn a_job_that_nobody_waits_for_goes_at_once_with_its_place_and_what_it_holds() {
        let pool = pool(1);
        let (release, running) = kept_busy(&pool).await;
        let held = Arc::new(());
        let gone = spawned(&pool, {
            let held = Arc::clone(&held);
            move |_| drop(held)
        });
        until(|| pool.in_use().waiting == 1).await;
        gone.abort();
        assert!(gone.await.unwrap_err().is_cancelled());
        assert_eq!((pool.in_use().waiting, pool.in_use().cancelled), (0, 1));
        assert_eq!(Arc::strong_count(&held), 1);
        release.send(()).unwrap();
        running.await.unwrap().unwrap();
        // Its turn would have come by now.
        pool.run(|_| ()).await.unwrap();
        assert_eq!(pool.in_use().begun, 2);
    }

    #[tokio::test]
    async fn a_job_in_hand_learns_that_its_caller_has_gone() {
        let pool = pool(0);
        let gone = spawned(&pool, |stop| {
            while !stop.is_stopped() {
                std::thread::yield_now();
            }
        });
        until(|| pool.in_use().running == 1).await;
        gone.abort();
        until(|| pool.in_use().cancelled == 1).await;
        assert_eq!(pool.in_use().running, 0);
    }

    #[tokio::test]
    async fn threads_beside_others_give_way_to_them() {
        let other = Pool::new("test", 5, 1).unwrap();
        let beside = Pool::beside("beside", &other, 1).unwrap();
        assert_eq!(beside.threads.current_num_threads(), 2);
        #[cfg(target_os = "linux")]
        {
            let niceness = |_: StopSignal<'_>| rustix::process::getpriority_process(None).unwrap();
            let expected = (other.run(niceness).await.unwrap() + NICENESS).min(NICEST);
            assert_eq!(beside.run(niceness).await.unwrap(), expected);
        }
        let only = Pool::new("test", 1, 1).unwrap();
        assert_eq!(Pool::beside("beside", &only, 1).unwrap().threads.current_num_threads(), 1);
    }

    #[tokio::test]
    async fn a_job_that_panics_is_an_error_of_its_own() {
        let pool = pool(1);
        let failed = pool.run(|_| panic!("a defect")).await.map(|(): ()| ()).unwrap_err();
        assert_eq!(failed.reason, Reason::JobPanicked);
        assert_eq!(pool.run(|_| 1).await.unwrap(), 1);
    }
}
