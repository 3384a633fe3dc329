//! Threads that are free, and those that wait for one.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tokio::sync::oneshot::{self, Receiver, Sender};

use crate::work::asker::{Asker, Requester};
use crate::work::precedence::Precedence;
use crate::work::row::{Member, Row, TURN};
use mrol_map::map::RobotName;

/// Work of this long and longer is charged twice what the shortest is.
const LONG_WORK: Duration = Duration::from_millis(100);
/// Jobs of one asker that were begun and gave way: with so many, no other of its jobs is begun before one of them
/// ended.
const PAUSED_PER_ASKER_MAX: usize = 4;
/// Threads and their queue. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(in crate::work) struct FairQueue(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    threads: usize,
    /// What has precedence, and how many threads may be used at once meanwhile.
    behind: Option<(Precedence, usize)>,
    running: usize,
    waiting: usize,
    waiting_max: usize,
    /// Jobs that gave way.
    paused: usize,
    paused_max: usize,
    askers: Row<Asker, Robots>,
    next_ticket: u64,
}

/// What an asker's robots have, and wait for.
#[derive(Debug, Default)]
struct Robots {
    row: Row<Option<RobotName>, VecDeque<Ticket>>,
    /// Jobs that gave way.
    paused: usize,
}

/// A job that waits.
#[derive(Debug)]
struct Ticket {
    number: u64,
    give: Sender<HeldThread>,
    was_begun: bool,
}

/// A thread that is taken, until this is dropped.
#[derive(Debug)]
pub(in crate::work) struct HeldThread {
    queue: FairQueue,
    /// Whose it is; none once it was somebody else's.
    whose: Option<Requester>,
    since: Instant,
}

/// All places are taken, by others as much as by the asker.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::work) struct Full;

/// A place in the queue, which is given up when this is dropped.
struct Place<'a> {
    queue: &'a FairQueue,
    requester: &'a Requester,
    ticket: u64,
}

impl FairQueue {
    /// A queue for `threads` threads, all of them free, with `waiting_max` places and `paused_max` for jobs that
    /// gave way.
    pub(in crate::work) fn new(threads: usize, waiting_max: usize, paused_max: usize) -> Self {
        Self(Arc::new(Mutex::new(State {
            threads,
            behind: None,
            running: 0,
            waiting: 0,
            waiting_max,
            paused: 0,
            paused_max,
            askers: Row::default(),
            next_ticket: 0,
        })))
    }

    /// Jobs in hand, and jobs that wait for a thread.
    pub(in crate::work) fn running_and_waiting(&self) -> (usize, usize) {
        let state = self.0.lock();
        (state.running, state.waiting)
    }

    /// The same queue, which gives out at most `threads` threads at once while others have precedence, and at least
    /// one. Jobs in hand go on.
    #[must_use]
    pub(in crate::work) fn giving_precedence(self, precedence: Precedence, threads: usize) -> Self {
        self.0.lock().behind = Some((precedence, threads));
        self
    }

    /// Waits for a thread.
    ///
    /// # Errors
    /// At once where all places are taken; later, where somebody who asked less takes this one.
    pub(in crate::work) async fn take(&self, requester: &Requester) -> Result<HeldThread, Full> {
        let (ticket, given) = {
            let mut state = self.0.lock();
            if state.waiting == 0 && state.has_free() {
                state.begin(requester);
                return Ok(self.held_by(requester));
            }
            state.make_place_for(&requester.asker)?;
            let waiting = state.wait(requester, false);
            // Where precedence has ended meanwhile.
            self.give_free(&mut state);
            waiting
        };
        let _place = Place { queue: self, requester, ticket };
        given.await.map_err(|_| Full)
    }

    /// Threads of the system that jobs and those that gave way take at most.
    pub(in crate::work) fn threads_wanted(&self) -> usize {
        let state = self.0.lock();
        state.threads + state.paused_max
    }

    /// True where somebody else waits for the thread.
    pub(in crate::work) fn may_pause(&self, held: &HeldThread) -> bool {
        held.whose.as_ref().is_some_and(|whose| self.0.lock().others_wait(whose))
    }

    /// Gives the thread of a job that is not over to somebody else who waits, where somebody does: the job goes on once
    /// `Receiver` gives it a thread again.
    pub(in crate::work) fn pause(&self, held: &mut HeldThread) -> Option<Receiver<HeldThread>> {
        let whose = held.whose.clone()?;
        let mut state = self.0.lock();
        if !state.others_wait(&whose) {
            return None;
        }
        state.end(&whose, held.since.elapsed());
        let (_, given) = state.wait(&whose, true);
        held.whose = None;
        self.give_free(&mut state);
        Some(given)
    }

    fn held_by(&self, requester: &Requester) -> HeldThread {
        HeldThread { queue: self.clone(), whose: Some(requester.clone()), since: Instant::now() }
    }

    /// Gives the threads that are free to whose turn it is.
    fn give_free(&self, state: &mut State) {
        while state.has_free() {
            let Some((next, ticket)) = state.next() else { return };
            if let Err(mut refused) = ticket.give.send(self.held_by(&next)) {
                // The waiter has just gone: the thread goes on to the next.
                refused.whose = None;
                state.end(&next, Duration::ZERO);
            }
        }
    }
}

impl State {
    /// True where a job may begin.
    fn has_free(&self) -> bool {
        let behind = self.behind.as_ref().filter(|(precedence, _)| precedence.is_taken());
        self.running < behind.map_or(self.threads, |(_, threads)| (*threads).clamp(1, self.threads))
    }

    fn begin(&mut self, requester: &Requester) {
        self.running += 1;
        self.askers.begin(&requester.asker);
        self.askers.join(&requester.asker).of.row.begin(&requester.robot);
    }

    fn end(&mut self, requester: &Requester, took: Duration) {
        self.running -= 1;
        let share = took.as_secs_f64() / LONG_WORK.as_secs_f64();
        let extra = (share.min(1.0) * TURN as f64) as u64;
        self.askers.join(&requester.asker).of.row.end(&requester.robot, extra);
        self.askers.end(&requester.asker, extra);
    }

    /// Puts a job among those that wait: behind those of its robot, or before them where it was begun.
    fn wait(&mut self, requester: &Requester, was_begun: bool) -> (u64, Receiver<HeldThread>) {
        let (give, given) = oneshot::channel();
        let number = self.next_ticket;
        self.next_ticket += 1;
        self.waiting += 1;
        let asker = self.askers.join(&requester.asker);
        asker.waiting += 1;
        let robot = asker.of.row.join(&requester.robot);
        robot.waiting += 1;
        let ticket = Ticket { number, give, was_begun };
        if was_begun {
            robot.of.push_front(ticket);
            asker.of.paused += 1;
            self.paused += 1;
        } else {
            robot.of.push_back(ticket);
        }
        (number, given)
    }

    /// Whose turn it is, with what it waits for: a thread counts as its own.
    fn next(&mut self) -> Option<(Requester, Ticket)> {
        let asker = self.askers.next(|_| true)?.id.clone();
        let of = &self.askers.find(&asker)?.of;
        let may_begin = of.paused < PAUSED_PER_ASKER_MAX;
        let was_begun =
            |robot: &Member<_, VecDeque<Ticket>>| robot.of.front().is_some_and(|job| job.was_begun);
        let robot = of.row.next(|robot| may_begin || was_begun(robot))?.id.clone();
        let requester = Requester { asker, robot };
        let ticket = self.withdraw(&requester, VecDeque::pop_front)?;
        self.begin(&requester);
        Some((requester, ticket))
    }

    /// Takes a job of a requester out of those that wait.
    fn withdraw(
        &mut self,
        requester: &Requester,
        which: impl FnOnce(&mut VecDeque<Ticket>) -> Option<Ticket>,
    ) -> Option<Ticket> {
        let asker = self.askers.find(&requester.asker)?;
        let robot = asker.of.row.find(&requester.robot)?;
        let ticket = which(&mut robot.of)?;
        robot.waiting -= 1;
        asker.waiting -= 1;
        self.waiting -= 1;
        if ticket.was_begun {
            asker.of.paused -= 1;
            self.paused -= 1;
        }
        asker.of.row.forget_idle();
        Some(ticket)
    }

    /// Refuses the last job of somebody who has two more waiting than `asker`, where all places are taken.
    fn make_place_for(&mut self, asker: &Asker) -> Result<(), Full> {
        // Jobs that gave way were let in before.
        if self.waiting - self.paused < self.waiting_max {
            return Ok(());
        }
        let fresh = |member: &Member<Asker, Robots>| member.waiting - member.of.paused;
        let own = self.askers.find(asker).map_or(0, |member| fresh(member));
        let most = self.askers.members().iter().max_by_key(|member| fresh(member)).ok_or(Full)?;
        if fresh(most) < own + 2 {
            return Err(Full);
        }
        let most = most.id.clone();
        let robots = &self.askers.find(&most).ok_or(Full)?.of.row;
        let newest = |robot: &&Member<_, VecDeque<Ticket>>| {
            robot.of.back().filter(|job| !job.was_begun).map(|job| job.number)
        };
        let robot = robots.members().iter().max_by_key(newest).ok_or(Full)?.id.clone();
        let loser = Requester { asker: most, robot };
        self.withdraw(&loser, VecDeque::pop_back).map(drop).ok_or(Full)
    }

    /// True where another asker waits, or another robot of the same one whose job may be begun.
    fn others_wait(&mut self, whose: &Requester) -> bool {
        if self.paused >= self.paused_max {
            return false;
        }
        let other_askers =
            self.askers.members().iter().any(|other| other.id != whose.asker && other.waiting > 0);
        let own = self.askers.find(&whose.asker).filter(|own| own.of.paused + 1 < PAUSED_PER_ASKER_MAX);
        other_askers
            || own.is_some_and(|own| {
                own.of.row.members().iter().any(|robot| robot.id != whose.robot && robot.waiting > 0)
            })
    }
}

impl Drop for HeldThread {
    fn drop(&mut self) {
        if let Some(requester) = self.whose.take() {
            let mut state = self.queue.0.lock();
            state.end(&requester, self.since.elapsed());
            self.queue.give_free(&mut state);
        }
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        let mut state = self.queue.0.lock();
        let at = |jobs: &mut VecDeque<Ticket>| {
            let at = jobs.iter().position(|job| job.number == self.ticket)?;
            jobs.remove(at)
        };
        if state.withdraw(self.requester, at).is_some() {
            state.askers.forget_idle();
        }
    }
}
