//! How a job of a lane gives way between its parts.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use super::background::InBackground;
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
    /// Of a job that others are not to wait for.
    pub(super) in_background: RefCell<Option<InBackground>>,
    /// When the part in hand was begun.
    pub(super) part_begun: Cell<Instant>,
    pub(super) paused_for: Cell<Duration>,
}

impl Pauses<'_> {
    fn is_way_of_robots_due(&self) -> bool {
        self.in_background.borrow().as_ref().is_some_and(InBackground::is_due)
    }

    /// Leaves the core to robots whose scans fit, where they want it.
    fn give_way_to_robots(&self) {
        if let Some(in_background) = self.in_background.borrow_mut().as_mut().filter(|job| job.is_due()) {
            in_background.pause_after(self.part_begun.get().elapsed());
        }
    }

    /// Gives the thread to another job of the lane, where one waits.
    fn give_way_in_lane(&self) {
        let mut held = self.held.borrow_mut();
        // The job that takes the turn needs a thread of the system besides this one, which waits.
        if !self.queue.may_pause(&held) || self.threads.have(self.queue.threads_wanted()).is_err() {
            return;
        }
        let Some(turn) = self.queue.pause(&mut held) else { return };
        // The queue gives a thread to every waiter, and refuses no job that was begun.
        if let Ok(thread) = turn.blocking_recv() {
            *held = thread;
        }
    }
}

impl GiveWay for Pauses<'_> {
    fn is_due(&self) -> bool {
        self.part_begun.get().elapsed() >= self.part
            && (self.is_way_of_robots_due() || self.queue.may_pause(&self.held.borrow()))
    }

    fn give_way(&self) {
        if !self.is_due() {
            return;
        }
        let begin = Instant::now();
        self.give_way_to_robots();
        self.give_way_in_lane();
        self.part_begun.set(Instant::now());
        self.paused_for.set(self.paused_for.get() + begin.elapsed());
    }

    fn paused_for(&self) -> Duration {
        self.paused_for.get()
    }
}
