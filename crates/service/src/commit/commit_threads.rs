//! The threads that commit: as many as the machine has use for, however many maps there are.
//!
//! A map that has something to commit waits in a row for a thread, takes one for a group of changes, and goes to the
//! end of the row where more has come meanwhile. So the changes of one map stay in order, and no map keeps the others
//! waiting.

use std::collections::VecDeque;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use crate::error::{Reason, ServiceError};
use mrol_map::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use mrol_map::sync::{Mutex, Rank, thread};

/// Threads for each core: a thread waits for the disk most of the time.
const THREADS_A_CORE: usize = 2;
/// Threads where there are few cores.
const THREADS_MIN: usize = 4;
/// Threads where disks hang: each may keep one for as long as it likes.
const THREADS_MAX: usize = 1024;
/// Time without any progress after which the threads count as held by disks that hang, and another is started.
const STUCK_AFTER: Duration = Duration::from_millis(250);

/// What a thread does for one map.
pub(super) trait Turn: Send + Sync {
    /// Commits a group; true where more has come meanwhile, so that another turn is due.
    fn take(&self) -> bool;

    /// Asks for a turn, unless one is due anyhow.
    fn wake(self: Arc<Self>, threads: &CommitThreads);
}

/// The threads that commit the changes of all maps. The last map that is dropped, or this where there is none, ends
/// them.
#[derive(Debug)]
pub(crate) struct CommitThreads(Arc<Shared>);

struct Shared {
    /// Threads while no disk hangs.
    most: usize,
    state: Mutex<State>,
}

struct State {
    /// Maps that wait for a thread.
    ready: VecDeque<Arc<dyn Turn>>,
    /// Threads that wait for a map.
    idle: Vec<SyncSender<Arc<dyn Turn>>>,
    started: usize,
    /// When a map was last handed to a thread.
    handed: Instant,
    /// What wakes maps later, once one has asked for that.
    alarm: Option<Sender<Alarm>>,
    is_closed: bool,
}

struct Alarm {
    at: Instant,
    map: Weak<dyn Turn>,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").field("most", &self.most).finish_non_exhaustive()
    }
}

impl CommitThreads {
    /// Starts one thread; others come when they are needed, by the number of cores.
    ///
    /// # Errors
    /// When the system has no thread left.
    pub(crate) fn start() -> Result<Arc<Self>, ServiceError> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let state = State {
            ready: VecDeque::new(),
            idle: Vec::new(),
            started: 0,
            handed: Instant::now(),
            alarm: None,
            is_closed: false,
        };
        let most = (cores * THREADS_A_CORE).max(THREADS_MIN);
        let threads = Self(Arc::new(Shared { most, state: Mutex::new(Rank::Brief, state) }));
        threads.0.state.lock().started += 1;
        threads.start_one(0).map_err(|error| ServiceError::new(Reason::NoThreads, error.to_string()))?;
        Ok(Arc::new(threads))
    }

    /// Gives `map` a turn when a thread is free.
    pub(super) fn schedule(&self, map: Arc<dyn Turn>) {
        let mut state = self.0.state.lock();
        if let Some(thread) = state.idle.pop() {
            state.handed = Instant::now();
            drop(state);
            // It waits for just this.
            drop(thread.send(map));
            return;
        }
        state.ready.push_back(map);
        let number = state.started;
        let is_needed = number < self.0.most || state.is_stuck();
        self.start_another(state, is_needed, number);
    }

    /// Starts another thread where maps wait and all threads are held by disks that hang.
    pub(crate) fn relieve(&self) {
        let state = self.0.state.lock();
        let (is_needed, number) = (state.is_stuck(), state.started);
        self.start_another(state, is_needed, number);
    }

    fn start_another(
        &self,
        mut state: mrol_map::sync::MutexGuard<'_, State>,
        is_needed: bool,
        number: usize,
    ) {
        if !is_needed {
            return;
        }
        state.started += 1;
        state.handed = Instant::now();
        drop(state);
        if let Err(error) = self.start_one(number) {
            // Those that are there go on.
            self.0.state.lock().started -= 1;
            tracing::warn!(%error, "no further thread for commits can be started");
        }
    }

    fn start_one(&self, number: usize) -> std::io::Result<()> {
        let shared = Arc::clone(&self.0);
        let thread = thread::Builder::new().name(format!("mrol-commit-{number}"));
        thread.spawn(move || shared.work()).map(drop)
    }

    /// Wakes `map` at a time of its own, if it is there then.
    ///
    /// # Errors
    /// When the system has no thread left.
    pub(super) fn wake_at(self: &Arc<Self>, at: Instant, map: Weak<dyn Turn>) -> std::io::Result<()> {
        let mut state = self.0.state.lock();
        if state.alarm.is_none() {
            let (alarm, alarms) = channel();
            state.alarm = Some(alarm);
            drop(state);
            let threads = Arc::downgrade(self);
            let thread = thread::Builder::new().name("mrol-commit-alarm".to_owned());
            let started = thread.spawn(move || ring(&alarms, &threads));
            state = self.0.state.lock();
            if let Err(error) = started {
                state.alarm = None;
                return Err(error);
            }
        }
        if let Some(alarm) = &state.alarm {
            drop(alarm.send(Alarm { at, map }));
        }
        Ok(())
    }
}

/// Wakes maps at their times, which are in order: all maps wait for as long.
fn ring(alarms: &Receiver<Alarm>, threads: &Weak<CommitThreads>) {
    while let Ok(Alarm { at, map }) = alarms.recv() {
        std::thread::sleep(at.saturating_duration_since(Instant::now()));
        if let (Some(map), Some(threads)) = (map.upgrade(), threads.upgrade()) {
            map.wake(&threads);
        }
    }
}

impl Drop for CommitThreads {
    fn drop(&mut self) {
        let mut state = self.0.state.lock();
        state.is_closed = true;
        let ended = (std::mem::take(&mut state.idle), state.alarm.take());
        drop(state);
        drop(ended);
    }
}

impl State {
    fn is_stuck(&self) -> bool {
        !self.ready.is_empty() && self.started < THREADS_MAX && self.handed.elapsed() >= STUCK_AFTER
    }
}

impl Shared {
    fn work(&self) {
        while let Some(map) = self.next() {
            if map.take() {
                self.state.lock().ready.push_back(map);
            }
        }
    }

    /// The map whose turn it is; none once the thread is not needed any more.
    fn next(&self) -> Option<Arc<dyn Turn>> {
        let mut state = self.state.lock();
        if let Some(map) = state.ready.pop_front() {
            state.handed = Instant::now();
            return Some(map);
        }
        if state.is_closed || state.started > self.most {
            state.started -= 1;
            return None;
        }
        let (thread, handed) = sync_channel(1);
        state.idle.push(thread);
        drop(state);
        handed.recv().ok()
    }
}

#[cfg(all(test, not(feature = "shuttle")))]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::mpsc;

    use super::*;

    /// A map whose turn lasts until it is let go.
    struct Hung {
        begun: mpsc::Sender<()>,
        go_on: parking_lot::Mutex<mpsc::Receiver<()>>,
    }

    impl Turn for Hung {
        fn take(&self) -> bool {
            let _ = self.begun.send(());
            let _ = self.go_on.lock().recv();
            false
        }

        fn wake(self: Arc<Self>, threads: &CommitThreads) {
            threads.schedule(self);
        }
    }

    /// A map that wants so many turns.
    struct Busy {
        number: usize,
        turns: AtomicUsize,
        told: mpsc::Sender<usize>,
    }

    impl Turn for Busy {
        fn take(&self) -> bool {
            let _ = self.told.send(self.number);
            self.turns.fetch_sub(1, Ordering::AcqRel) > 1
        }

        fn wake(self: Arc<Self>, threads: &CommitThreads) {
            threads.schedule(self);
        }
    }

    #[test]
    fn many_maps_take_turns_at_few_threads() {
        const MAPS: usize = 500;
        let threads = CommitThreads::start().unwrap();
        let (told, all) = mpsc::channel();
        for number in 0..MAPS {
            threads.schedule(Arc::new(Busy { number, turns: AtomicUsize::new(3), told: told.clone() }));
        }
        let mut turns = vec![0; MAPS];
        all.iter().take(3 * MAPS).for_each(|number| turns[number] += 1);
        assert!(turns.iter().all(|&turns| turns == 3));
        let state = threads.0.state.lock();
        assert!(state.started <= threads.0.most, "{} threads", state.started);
    }

    #[test]
    fn maps_whose_disks_hang_keep_no_other_map_from_its_turn() {
        let threads = CommitThreads::start().unwrap();
        let (begun, all_begun) = mpsc::channel();
        let hung = 2 * threads.0.most;
        let mut holds = Vec::new();
        for _ in 0..hung {
            let (hold, held) = mpsc::channel();
            holds.push(hold);
            threads.schedule(Arc::new(Hung { begun: begun.clone(), go_on: parking_lot::Mutex::new(held) }));
        }
        let (told, free) = mpsc::channel();
        threads.schedule(Arc::new(Busy { number: 7, turns: AtomicUsize::new(1), told }));
        while free.try_recv() != Ok(7) {
            threads.relieve();
            std::thread::yield_now();
        }
        assert_eq!(all_begun.iter().take(hung).count(), hung);
        drop(holds);
        // Threads that are not needed any more end.
        while threads.0.state.lock().started > threads.0.most {
            std::thread::yield_now();
        }
    }
}
