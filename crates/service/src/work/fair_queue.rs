//! The threads of a pool that are free, and who waits for one.
//!
//! Callers take turns: a thread that comes free goes to the caller who has the fewest threads of those who wait, and of
//! several such to the one whose last turn is longest ago. So who asks one question waits for about one question of
//! somebody who asks many. Nobody waits forever: who has had a turn goes to the end of the row, and who comes anew
//! joins it there. What one caller asks is begun in order.

use std::collections::VecDeque;
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::oneshot::{self, Sender};

use super::asker::Asker;

/// Threads and their queue. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(super) struct ThreadQueue(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    free: usize,
    /// Those who have a thread or wait for one; first whose last turn is longest ago.
    callers: VecDeque<Caller>,
    next_ticket: u64,
}

/// What a caller has, and waits for.
#[derive(Debug)]
struct Caller {
    asker: Asker,
    running: usize,
    /// In the order in which they came.
    tickets: VecDeque<(u64, Sender<HeldThread>)>,
}

/// A thread that is taken, until this is dropped.
#[derive(Debug)]
pub(super) struct HeldThread {
    queue: ThreadQueue,
    /// Whose it is; none once it was somebody else's.
    asker: Option<Asker>,
}

/// A place in the queue, which is given up when this is dropped.
struct Place<'a> {
    queue: &'a ThreadQueue,
    asker: &'a Asker,
    ticket: u64,
}

impl ThreadQueue {
    /// A queue for `threads` threads, all of them free.
    pub(super) fn new(threads: usize) -> Self {
        Self(Arc::new(Mutex::new(State { free: threads, callers: VecDeque::new(), next_ticket: 0 })))
    }

    /// Threads that have nothing to do.
    pub(super) fn free(&self) -> usize {
        self.0.lock().free
    }

    /// Waits for a thread.
    pub(super) async fn take(&self, asker: &Asker) -> HeldThread {
        let (ticket, given) = {
            let mut state = self.0.lock();
            let free = state.free;
            let caller = state.caller(asker);
            if free > 0 {
                caller.running += 1;
                state.free -= 1;
                return HeldThread { queue: self.clone(), asker: Some(asker.clone()) };
            }
            let (give, given) = oneshot::channel();
            let ticket = state.next_ticket;
            state.next_ticket += 1;
            state.caller(asker).tickets.push_back((ticket, give));
            (ticket, given)
        };
        let _place = Place { queue: self, asker, ticket };
        match given.await {
            Ok(thread) => thread,
            // Only its own place takes a ticket away without a thread.
            Err(_) => std::future::pending().await,
        }
    }

    /// Gives a thread that `asker` had to whose turn it is.
    fn give_back(&self, asker: &Asker) {
        let mut state = self.0.lock();
        state.end_turn(asker);
        while let Some((next, give)) = state.next() {
            let thread = HeldThread { queue: self.clone(), asker: Some(next.clone()) };
            let Err(mut refused) = give.send(thread) else { return };
            // Who waited has just gone: the thread goes on to the next.
            refused.asker = None;
            state.end_turn(&next);
        }
        state.free += 1;
    }
}

impl State {
    fn caller(&mut self, asker: &Asker) -> &mut Caller {
        let known = self.callers.iter().position(|caller| caller.asker == *asker);
        let at = known.unwrap_or_else(|| {
            self.callers.push_back(Caller { asker: asker.clone(), running: 0, tickets: VecDeque::new() });
            self.callers.len() - 1
        });
        &mut self.callers[at]
    }

    /// Whose turn it is, with the first of what it waits for: the thread counts as its own.
    fn next(&mut self) -> Option<(Asker, Sender<HeldThread>)> {
        let waiting = self.callers.iter_mut().filter(|caller| !caller.tickets.is_empty());
        let caller = waiting.min_by_key(|caller| caller.running)?;
        let (_, give) = caller.tickets.pop_front()?;
        caller.running += 1;
        Some((caller.asker.clone(), give))
    }

    /// A caller has a thread less, and had its turn.
    fn end_turn(&mut self, asker: &Asker) {
        let Some(at) = self.callers.iter().position(|caller| caller.asker == *asker) else { return };
        let Some(mut caller) = self.callers.remove(at) else { return };
        caller.running -= 1;
        if caller.running > 0 || !caller.tickets.is_empty() {
            self.callers.push_back(caller);
        }
    }

    fn give_up(&mut self, asker: &Asker, ticket: u64) {
        let Some(at) = self.callers.iter().position(|caller| caller.asker == *asker) else { return };
        let caller = &mut self.callers[at];
        caller.tickets.retain(|(number, _)| *number != ticket);
        if caller.running == 0 && caller.tickets.is_empty() {
            self.callers.remove(at);
        }
    }
}

impl Drop for HeldThread {
    fn drop(&mut self) {
        if let Some(asker) = self.asker.take() {
            self.queue.give_back(&asker);
        }
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.queue.0.lock().give_up(self.asker, self.ticket);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::pin::Pin;
    use std::task::{Context, Poll, Waker};

    type Wanted<'a> = Pin<Box<dyn Future<Output = HeldThread> + 'a>>;

    /// Callers by number.
    fn askers<const N: usize>() -> [Asker; N] {
        std::array::from_fn(Asker::at)
    }

    /// The thread, where it is given.
    fn given(wanted: &mut Wanted<'_>) -> Option<HeldThread> {
        match wanted.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(thread) => Some(thread),
            Poll::Pending => None,
        }
    }

    /// A thread that was free.
    fn taken(queue: &ThreadQueue, asker: &Asker) -> HeldThread {
        let mut wanted: Wanted<'_> = Box::pin(queue.take(asker));
        given(&mut wanted).unwrap()
    }

    fn has_one(queue: &ThreadQueue, asker: &Asker) -> bool {
        queue.0.lock().callers.iter().any(|caller| caller.asker == *asker && caller.running > 0)
    }

    /// Somebody who waits for a thread from now on.
    fn waits<'a>(queue: &'a ThreadQueue, asker: &'a Asker) -> Wanted<'a> {
        let mut wanted: Wanted<'a> = Box::pin(queue.take(asker));
        assert!(given(&mut wanted).is_none());
        wanted
    }

    /// Ends `held`, and what is given a thread then, one after the other: the callers in the order of their turns.
    fn turns<'a>(mut held: HeldThread, mut waiting: Vec<(&'a str, Wanted<'a>)>) -> Vec<&'a str> {
        let mut turns = Vec::new();
        loop {
            drop(held);
            let mut now =
                waiting.iter_mut().enumerate().filter_map(|(i, (_, wanted))| Some((i, given(wanted)?)));
            let Some((i, thread)) = now.next() else { break };
            assert!(now.next().is_none(), "there is one thread");
            drop(now);
            held = thread;
            turns.push(waiting.remove(i).0);
        }
        assert!(waiting.is_empty());
        turns
    }

    #[test]
    fn callers_take_turns_and_each_is_served_in_order() {
        let (queue, [many, two, one]) = (ThreadQueue::new(1), askers());
        let held = taken(&queue, &many);
        let names = ["many 1", "many 2", "many 3", "two 1", "two 2", "one"];
        let who = [&many, &many, &many, &two, &two, &one];
        let waiting = names.into_iter().zip(who.map(|asker| waits(&queue, asker))).collect();
        // Who has had the thread is last in the row.
        assert_eq!(turns(held, waiting), ["two 1", "one", "many 1", "two 2", "many 2", "many 3"]);
        assert_eq!(queue.free(), 1);
        assert!(queue.0.lock().callers.is_empty());
    }

    #[test]
    fn a_thread_that_comes_free_goes_to_who_has_fewest() {
        let (queue, [many, few]) = (ThreadQueue::new(3), askers());
        let (first, _second, _third) = (taken(&queue, &few), taken(&queue, &many), taken(&queue, &many));
        let (mut of_many, mut of_few) = (waits(&queue, &many), waits(&queue, &few));
        // It was the turn of the one who has none now, whoever came first.
        drop(first);
        assert!(given(&mut of_many).is_none());
        assert!(given(&mut of_few).is_some());
    }

    #[test]
    fn who_goes_leaves_no_trace_whether_or_not_a_thread_was_given() {
        let (queue, [a, b]) = (ThreadQueue::new(1), askers());
        let held = taken(&queue, &a);
        let (gone, given_and_gone, mut last) = (waits(&queue, &a), waits(&queue, &b), waits(&queue, &a));
        drop(gone);
        drop(held);
        // It has the thread, and did not look.
        assert!(given(&mut last).is_none());
        drop(given_and_gone);
        drop(given(&mut last).unwrap());
        assert_eq!(queue.free(), 1);
        assert!(queue.0.lock().callers.is_empty());
    }

    proptest! {
        /// Whatever comes and goes, threads are neither lost nor made, none is free while somebody waits, and nobody
        /// waits for more turns than there are others.
        #[test]
        fn nobody_waits_for_more_turns_than_there_are_others(
            threads in 1usize..4,
            steps in prop::collection::vec((0usize..4, 0usize..3, any::<prop::sample::Index>()), 1..200),
        ) {
            let (queue, askers) = (ThreadQueue::new(threads), askers::<4>());
            let (mut held, mut waiting) = (Vec::<HeldThread>::new(), Vec::<(usize, Wanted<'_>, usize)>::new());
            for (who, what, which) in steps {
                match what {
                    0 => waiting.push((who, Box::pin(queue.take(&askers[who])), 0)),
                    1 if !held.is_empty() => drop(held.swap_remove(which.index(held.len()))),
                    2 if !waiting.is_empty() => drop(waiting.remove(which.index(waiting.len()))),
                    _ => {}
                }
                let mut i = 0;
                while i < waiting.len() {
                    let Some(thread) = given(&mut waiting[i].1) else { i += 1; continue };
                    held.push(thread);
                    let (served, ..) = waiting.remove(i);
                    // A turn of somebody else for those who have no thread and are first among their own.
                    for other in (0..askers.len()).filter(|other| *other != served) {
                        if let Some((_, _, turns)) = waiting.iter_mut().find(|(who, ..)| *who == other) {
                            *turns = if has_one(&queue, &askers[other]) { 0 } else { *turns + 1 };
                        }
                    }
                    i = 0;
                }
                prop_assert_eq!(queue.free() + held.len(), threads);
                prop_assert!(queue.free() == 0 || waiting.is_empty());
                for (who, _, turns) in &waiting {
                    prop_assert!(has_one(&queue, &askers[*who]) || *turns <= askers.len() + threads, "{turns} turns");
                }
            }
            drop((held, waiting));
            prop_assert_eq!(queue.free(), threads);
            prop_assert!(queue.0.lock().callers.is_empty());
        }
    }
}
