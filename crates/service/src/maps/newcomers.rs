//! The callers that brought robots into a map: none takes all names that a map has room for.

use std::collections::HashMap;

use crate::work::Asker;
use mrol_map::map::RobotName;
use mrol_map::sync::{Mutex, Rank};

/// Robots by the caller with whose first scan they came, since the map was opened.
#[derive(Debug)]
pub(crate) struct Newcomers(Mutex<HashMap<Asker, Vec<RobotName>>>);

impl Default for Newcomers {
    fn default() -> Self {
        Self(Mutex::new(Rank::Brief, HashMap::new()))
    }
}

impl Newcomers {
    /// Lets a robot in that has no scans in the map yet, unless `asker` brought `most` others in that have some, as
    /// `has_scans` says. What was refused or undone since counts no longer.
    pub(crate) fn admit(
        &self,
        asker: &Asker,
        robot: &RobotName,
        most: usize,
        has_scans: impl Fn(&RobotName) -> bool,
    ) -> bool {
        let mut all = self.0.lock();
        let of_asker = all.entry(asker.clone()).or_default();
        if of_asker.contains(robot) {
            return true;
        }
        if of_asker.len() >= most {
            of_asker.retain(&has_scans);
        }
        if of_asker.len() >= most {
            return false;
        }
        of_asker.push(robot.clone());
        if all.len() > ASKERS_MAX {
            all.retain(|_, robots| {
                robots.retain(&has_scans);
                !robots.is_empty()
            });
        }
        true
    }
}

/// Callers that are remembered before those are forgotten whose robots have no scans.
const ASKERS_MAX: usize = 1024;

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn a_caller_brings_in_so_many_robots_with_scans_and_leaves_room_for_others() {
        let (newcomers, mut with_scans) = (Newcomers::default(), BTreeSet::new());
        let (one, other) = (Asker::with_key("one"), Asker::at("10.0.0.2"));
        let robot = |n: usize| RobotName::new(&format!("r{n}")).unwrap();
        let admit = |asker: &Asker, n: usize, with_scans: &BTreeSet<RobotName>| {
            newcomers.admit(asker, &robot(n), 3, |robot| with_scans.contains(robot))
        };
        for n in 0..3 {
            assert!(admit(&one, n, &with_scans));
            with_scans.insert(robot(n));
        }
        assert!(!admit(&one, 3, &with_scans) && admit(&other, 3, &with_scans));
        assert!(admit(&one, 2, &with_scans), "its own again");
        // All scans of one were undone.
        with_scans.remove(&robot(0));
        assert!(admit(&one, 4, &with_scans));
        // Robots whose scans were refused count no longer once there are too many.
        assert!(admit(&one, 5, &with_scans));
    }

    #[test]
    fn callers_who_left_nothing_are_forgotten() {
        let newcomers = Newcomers::default();
        for n in 0..3 * ASKERS_MAX {
            assert!(newcomers.admit(&Asker::at(n), &RobotName::new("r").unwrap(), 3, |_| false));
        }
        assert!(newcomers.0.lock().len() <= ASKERS_MAX + 1);
    }
}
