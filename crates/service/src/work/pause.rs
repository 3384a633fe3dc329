//! How a job of a lane gives way between its parts.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use super::fair_queue::{FairQueue, HeldThread};
use super::threads::Threads;
use mrol_map::util::GiveWay;

/// Time that a part of long work takes, after which the job gives way if others wait.
pub(super) const PART: Duration = Duration::from_millis(25);
/// The same for a requester whose work keeps failing.
pub(super) const PART_OF_FAILING: Duration = Duration::from_millis(5);

/// The thread of a job in hand, which the job gives back between its parts.
pub(super) struct Pauses<'a> {
    pub(super) queue: &'a FairQueue,
    pub(super) threads: &'a Threads,
    pub(super) part: Duration,
    pub(super) held: RefCell<HeldThread>,
    pub(super) paused_for: Cell<Duration>,
}

impl GiveWay for Pauses<'_> {
    fn is_due(&self) -> bool {
        let held = self.held.borrow();
        held.held_for() >= self.part && self.queue.may_pause(&held)
    }

    fn give_way(&self) {
        if !self.is_due() {
            return;
        }
        let mut held = self.held.borrow_mut();
        // The job that takes the turn needs a thread of the system besides this one, which waits.
        if self.threads.have(self.queue.threads_wanted()).is_err() {
            return;
        }
        let begin = Instant::now();
        let Some(turn) = self.queue.pause(&mut held) else { return };
        // The queue gives a thread to every waiter, and refuses no job that was begun.
        if let Ok(thread) = turn.blocking_recv() {
            *held = thread;
        }
        self.paused_for.set(self.paused_for.get() + begin.elapsed());
    }

    fn paused_for(&self) -> Duration {
        self.paused_for.get()
    }
}
