//! Requesters whose recent work failed.

use std::collections::HashMap;

use parking_lot::Mutex;

use super::asker::Requester;

/// Consecutive failures after which a requester's work gives way to that of others.
const FAILURES_MAX: u32 = 3;
/// Requesters that are remembered, at most; beyond, the one that was noted longest ago is forgotten.
const REMEMBERED_MAX: usize = 1024;

/// Requesters, with the failures since their last success.
#[derive(Debug, Default)]
pub(super) struct Failures(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    of: HashMap<Requester, Noted>,
    noted: u64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Noted {
    failures: u32,
    last: u64,
}

impl Failures {
    /// Notes how work ended, for the robot and for its asker: an asker may send each scan under a new robot name.
    pub(super) fn note(&self, requester: &Requester, succeeded: bool) {
        let mut state = self.0.lock();
        state.noted += 1;
        let last = state.noted;
        for who in [requester.clone(), Requester::from(&requester.asker)] {
            let of = state.of.entry(who).or_default();
            let failures = if succeeded { 0 } else { of.failures.saturating_add(1) };
            *of = Noted { failures, last };
        }
        while state.of.len() > REMEMBERED_MAX {
            let oldest = state.of.iter().min_by_key(|(_, noted)| noted.last).map(|(who, _)| who.clone());
            oldest.and_then(|who| state.of.remove(&who));
        }
    }

    /// True after [`FAILURES_MAX`] consecutive failures of the robot; or of its asker, unless the robot's last work
    /// succeeded.
    pub(super) fn is_failing(&self, requester: &Requester) -> bool {
        let state = self.0.lock();
        let failures = |who: &Requester| state.of.get(who).map(|noted| noted.failures);
        let fails = |who: &Requester| failures(who).is_some_and(|failures| failures >= FAILURES_MAX);
        fails(requester) || failures(requester) != Some(0) && fails(&Requester::from(&requester.asker))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::Asker;
    use mrol_map::map::RobotName;

    #[test]
    fn who_fails_again_and_again_is_failing_until_it_succeeds_whatever_the_robots_name() {
        let (failures, asker) = (Failures::default(), Asker::with_key("one"));
        let robot = |name: &str| asker.for_robot(&RobotName::new(name).unwrap());
        for n in 0..FAILURES_MAX {
            assert!(!failures.is_failing(&robot("new")), "after {n}");
            failures.note(&robot(&format!("r{n}")), false);
        }
        assert!(failures.is_failing(&robot("new")));
        assert!(!failures.is_failing(&Requester::from(&Asker::with_key("other"))));
        failures.note(&robot("good"), true);
        assert!(!failures.is_failing(&robot("new")));
        // A robot that fails is one among those that do not.
        for _ in 0..FAILURES_MAX {
            failures.note(&robot("bad"), false);
            failures.note(&robot("good"), true);
        }
        assert!(failures.is_failing(&robot("bad")));
        assert!(!failures.is_failing(&robot("good")));
        // Nor where the others of its asker all fail.
        for _ in 0..FAILURES_MAX {
            failures.note(&robot("bad"), false);
        }
        assert!(failures.is_failing(&robot("new")) && !failures.is_failing(&robot("good")));
    }

    #[test]
    fn no_more_are_remembered_than_may_and_the_newest_are() {
        let failures = Failures::default();
        let asker = |n: usize| Requester::from(&Asker::at(n));
        for _ in 0..FAILURES_MAX {
            (0..REMEMBERED_MAX).for_each(|n| failures.note(&asker(n), false));
        }
        failures.note(&asker(REMEMBERED_MAX), false);
        assert_eq!(failures.0.lock().of.len(), REMEMBERED_MAX);
        assert!(!failures.is_failing(&asker(0)));
        assert!(failures.is_failing(&asker(1)));
    }
}
