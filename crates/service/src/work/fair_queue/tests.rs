//! Turns, counted: what is given to whom, in which order.

use std::pin::Pin;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use proptest::prelude::*;
use tokio::sync::oneshot::Receiver;

use super::queue::{FairQueue, Full, HeldThread};
use crate::work::precedence::Precedence;
use crate::work::{Asker, Requester};
use mrol_map::map::RobotName;

type Wanted<'a> = Pin<Box<dyn Future<Output = Result<HeldThread, Full>> + 'a>>;

const PLENTY: usize = 1000;

fn queue(threads: usize) -> FairQueue {
    FairQueue::new(threads, PLENTY, 16)
}

/// A robot of an asker; both by number.
fn of(asker: usize, robot: usize) -> Requester {
    Asker::at(asker).for_robot(&RobotName::new(&format!("r{robot}")).unwrap())
}

/// The answer, where it is there.
fn given<F: Future + Unpin>(wanted: &mut F) -> Option<F::Output> {
    match Pin::new(wanted).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(thread) => Some(thread),
        Poll::Pending => None,
    }
}

/// A thread that was free.
fn taken(queue: &FairQueue, requester: &Requester) -> HeldThread {
    let mut wanted: Wanted<'_> = Box::pin(queue.take(requester));
    given(&mut wanted).unwrap().unwrap()
}

/// A job that waits for a thread from now on.
fn waits<'a>(queue: &'a FairQueue, requester: &'a Requester) -> Wanted<'a> {
    let mut wanted: Wanted<'a> = Box::pin(queue.take(requester));
    assert!(given(&mut wanted).is_none());
    wanted
}

/// Ends `held`, and what is given a thread then, one after the other: the names in the order of their turns.
fn turns<'a>(mut held: HeldThread, mut waiting: Vec<(&'a str, Wanted<'a>)>) -> Vec<&'a str> {
    let mut turns = Vec::new();
    loop {
        drop(held);
        let mut now =
            waiting.iter_mut().enumerate().filter_map(|(i, (_, wanted))| Some((i, given(wanted)?.unwrap())));
        let Some((i, thread)) = now.next() else { break };
        assert!(now.next().is_none(), "there is one thread");
        drop(now);
        held = thread;
        turns.push(waiting.remove(i).0);
    }
    assert!(waiting.is_empty());
    turns
}

fn is_empty(queue: &FairQueue) -> bool {
    queue.running_and_waiting() == (0, 0)
}

#[test]
fn askers_take_turns_and_each_is_served_in_order() {
    let (queue, [many, two, one]) = (queue(1), [of(0, 0), of(1, 0), of(2, 0)]);
    let held = taken(&queue, &many);
    let names = ["many 1", "many 2", "many 3", "two 1", "two 2", "one"];
    let who = [&many, &many, &many, &two, &two, &one];
    let waiting = names.into_iter().zip(who.map(|who| waits(&queue, who))).collect();
    // The caller that has had the thread is last in the row.
    assert_eq!(turns(held, waiting), ["two 1", "one", "many 1", "two 2", "many 2", "many 3"]);
    assert!(is_empty(&queue));
}

#[test]
fn an_asker_with_many_robots_has_one_turn_like_others_and_its_robots_take_turns() {
    let queue = queue(1);
    let robots: Vec<_> = (0..4).map(|robot| of(0, robot)).collect();
    let (other, again) = (of(1, 0), of(0, 0));
    let held = taken(&queue, &other);
    let mut waiting: Vec<(&str, Wanted<'_>)> = ["r0", "r1", "r2", "r3"]
        .into_iter()
        .zip(&robots)
        .map(|(name, who)| (name, waits(&queue, who)))
        .collect();
    waiting.insert(1, ("r0 again", waits(&queue, &again)));
    waiting.push(("other", waits(&queue, &other)));
    assert_eq!(turns(held, waiting), ["r0", "other", "r1", "r2", "r3", "r0 again"]);
}

#[test]
fn a_thread_that_comes_free_goes_to_who_has_fewest() {
    let (queue, [many, few]) = (queue(3), [of(0, 0), of(1, 0)]);
    let (first, _second, _third) = (taken(&queue, &few), taken(&queue, &many), taken(&queue, &many));
    let (mut of_many, mut of_few) = (waits(&queue, &many), waits(&queue, &few));
    drop(first);
    assert!(given(&mut of_many).is_none());
    assert!(given(&mut of_few).is_some());
}

#[test]
fn who_goes_leaves_no_trace_whether_or_not_a_thread_was_given() {
    let (queue, [a, b]) = (queue(1), [of(0, 0), of(1, 0)]);
    let held = taken(&queue, &a);
    let (gone, given_and_gone, mut last) = (waits(&queue, &a), waits(&queue, &b), waits(&queue, &a));
    drop(gone);
    drop(held);
    // It has the thread, and did not look.
    assert!(given(&mut last).is_none());
    drop(given_and_gone);
    drop(given(&mut last).unwrap());
    assert!(is_empty(&queue));
}

#[test]
fn who_asks_much_loses_a_place_to_who_comes_late() {
    let (queue, [many, late]) = (FairQueue::new(1, 3, 0), [of(0, 0), of(1, 0)]);
    let _held = taken(&queue, &many);
    let mut of_many: Vec<_> = (0..3).map(|_| waits(&queue, &many)).collect();
    assert_eq!(given(&mut Box::pin(queue.take(&many))).unwrap().unwrap_err(), Full);
    let _late = waits(&queue, &late);
    assert_eq!(given(&mut of_many[2]).unwrap().unwrap_err(), Full);
    assert!(given(&mut of_many[1]).is_none());
    // Two to one: nobody has two more than it would have.
    assert_eq!(given(&mut Box::pin(queue.take(&late))).unwrap().unwrap_err(), Full);
    assert_eq!(queue.running_and_waiting(), (1, 3));
}

#[test]
fn long_work_gives_its_thread_to_others_alone_and_goes_on_before_its_robots_next() {
    let (queue, [long, other]) = (queue(1), [of(0, 0), of(1, 0)]);
    let mut held = taken(&queue, &long);
    let mut next_of_long = waits(&queue, &long);
    assert!(!queue.may_pause(&held) && queue.pause(&mut held).is_none());
    let mut of_other = waits(&queue, &other);
    assert!(queue.may_pause(&held));
    let mut goes_on = queue.pause(&mut held).unwrap();
    drop(held);
    let of_other = given(&mut of_other).unwrap().unwrap();
    assert!(given(&mut goes_on).is_none());
    drop(of_other);
    let held = given(&mut goes_on).unwrap().unwrap();
    assert!(given(&mut next_of_long).is_none());
    drop(held);
    assert!(given(&mut next_of_long).is_some());
}

#[test]
fn no_more_jobs_are_begun_and_give_way_than_may() {
    let queue = FairQueue::new(1, PLENTY, 2);
    let [a, b, c, d] = [of(0, 0), of(1, 0), of(2, 0), of(3, 0)];
    let mut held = taken(&queue, &a);
    let mut waiting = [&b, &c, &d].map(|who| waits(&queue, who));
    let mut paused = Vec::new();
    for wanted in &mut waiting[..2] {
        paused.push(queue.pause(&mut held).unwrap());
        held = given(wanted).unwrap().unwrap();
    }
    assert!(!queue.may_pause(&held) && queue.pause(&mut held).is_none());
    // Of one asker, robots are not begun one after the other without end.
    let queue = self::queue(1);
    let robots: Vec<_> = (0..8).map(|robot| of(0, robot)).collect();
    let mut held = taken(&queue, &robots[0]);
    let mut waiting: Vec<_> = robots[1..].iter().map(|who| waits(&queue, who)).collect();
    let (mut paused, mut at) = (Vec::new(), 0);
    while let Some(goes_on) = queue.pause(&mut held) {
        paused.push(goes_on);
        held = given(&mut waiting[at]).unwrap().unwrap();
        at += 1;
    }
    assert_eq!(paused.len(), 3);
}

#[test]
fn threads_are_left_free_while_others_have_precedence_and_are_given_out_afterwards() {
    let others = Precedence::lingering(Duration::ZERO);
    let (queue, [a, b]) = (queue(3).giving_precedence(others.clone(), 1), [of(0, 0), of(1, 0)]);
    let at_work = others.begin();
    let held = taken(&queue, &a);
    let mut waiting = [waits(&queue, &a), waits(&queue, &b), waits(&queue, &a)];
    // Whoever ends makes room for one.
    drop(held);
    let held = given(&mut waiting[1]).unwrap().unwrap();
    assert!(given(&mut waiting[0]).is_none());
    drop(at_work);
    drop(held);
    assert!([0, 2].into_iter().all(|i| given(&mut waiting[i]).is_some()));
}

/// What a step of the test below does.
#[derive(Debug, Clone, Copy)]
enum Step {
    Asks(usize, usize),
    Ends,
    Leaves,
    Pauses,
}

fn steps() -> impl Strategy<Value = Vec<(Step, prop::sample::Index)>> {
    let step = prop_oneof![
        4 => (0usize..4, 0usize..3).prop_map(|(asker, robot)| Step::Asks(asker, robot)),
        3 => Just(Step::Ends),
        1 => Just(Step::Leaves),
        2 => Just(Step::Pauses),
    ];
    prop::collection::vec((step, any::<prop::sample::Index>()), 1..300)
}

/// Somebody who waits: whose it is, and the turns of each other asker since it has had none.
struct Waiting<'a> {
    who: &'a Requester,
    wanted: Either<'a>,
    turns_of_others: [usize; 4],
}

enum Either<'a> {
    Fresh(Wanted<'a>),
    Paused(Receiver<HeldThread>),
}

impl Either<'_> {
    fn given(&mut self) -> Option<HeldThread> {
        match self {
            Self::Fresh(wanted) => given(wanted).map(Result::unwrap),
            Self::Paused(turn) => given(turn).map(Result::unwrap),
        }
    }
}

proptest! {
    /// Whatever comes and goes and gives way, threads are neither lost nor made, none is free while somebody waits, and
    /// an asker that has no thread waits for at most two turns of each other.
    #[test]
    fn nobody_waits_for_more_than_two_turns_of_another(threads in 1usize..4, steps in steps()) {
        let (queue, who) = (queue(threads), (0..12).map(|n| of(n / 3, n % 3)).collect::<Vec<_>>());
        let asker_of = |who: &Requester| (0..4).find(|n| who.asker == Asker::at(n)).unwrap();
        let (mut held, mut waiting) = (Vec::<(&Requester, HeldThread)>::new(), Vec::<Waiting<'_>>::new());
        for (step, which) in steps {
            let begin = |who, wanted| Waiting { who, wanted, turns_of_others: [0; 4] };
            match step {
                Step::Asks(asker, robot) => {
                    let who = &who[3 * asker + robot];
                    waiting.push(begin(who, Either::Fresh(Box::pin(queue.take(who)))));
                }
                Step::Ends if !held.is_empty() => drop(held.swap_remove(which.index(held.len()))),
                Step::Leaves if !waiting.is_empty() => {
                    let at = which.index(waiting.len());
                    if matches!(waiting[at].wanted, Either::Fresh(_)) {
                        drop(waiting.remove(at));
                    }
                }
                Step::Pauses if !held.is_empty() => {
                    let at = which.index(held.len());
                    if let Some(turn) = queue.pause(&mut held[at].1) {
                        let (who, _) = held.swap_remove(at);
                        waiting.push(begin(who, Either::Paused(turn)));
                    }
                }
                _ => {}
            }
            let mut i = 0;
            while i < waiting.len() {
                let Some(thread) = waiting[i].wanted.given() else { i += 1; continue };
                let served = waiting.remove(i).who;
                held.push((served, thread));
                for other in waiting.iter_mut().filter(|other| other.who.asker != served.asker) {
                    other.turns_of_others[asker_of(served)] += 1;
                }
                i = 0;
            }
            // Jobs that have a thread are served, whatever else they wait for.
            for one in &mut waiting {
                let is_first = held.iter().all(|(who, _)| who.asker != one.who.asker);
                if !is_first {
                    one.turns_of_others = [0; 4];
                }
            }
            let (running, in_queue) = queue.running_and_waiting();
            prop_assert_eq!((running, in_queue), (held.len(), waiting.len()));
            prop_assert!(running == threads || waiting.is_empty());
            for asker in 0..4 {
                // The asker's first to be served is the one that waited for fewest.
                let own = waiting.iter().filter(|one| asker_of(one.who) == asker);
                let turns = own.map(|one| one.turns_of_others).reduce(|a, b| std::array::from_fn(|i| a[i].min(b[i])));
                prop_assert!(turns.is_none_or(|turns| turns.iter().all(|turns| *turns <= 2)), "{turns:?}");
            }
        }
        drop((held, waiting));
        prop_assert!(is_empty(&queue));
    }
}
