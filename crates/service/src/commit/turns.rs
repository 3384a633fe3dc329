//! Whose change is made next, of those that wait for a map.

use std::collections::VecDeque;

use super::submission::{Submission, Waiting};
use crate::work::{Asker, Row, TURN};
use mrol_map::map::RobotName;

/// Finest voxels of all changes of a group, at most where it has more than one: what is made in about a tenth of a
/// second, for which one sync more is nothing.
const GROUP_VOXELS_MAX: usize = 500_000;
/// A change of as many voxels is charged twice what the smallest is.
const LARGE_CHANGE_VOXELS: usize = 100_000;

/// Changes that wait. Askers take turns, and the robots of an asker among themselves; changes of one robot, and those
/// of one asker that are of no robot, are made in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Turns {
    askers: Row<Asker, Row<Option<RobotName>, VecDeque<Waiting>>>,
    waiting: usize,
}

impl Turns {
    /// True where nothing waits.
    pub(super) fn is_empty(&self) -> bool {
        self.waiting == 0
    }

    /// Puts a change behind those of its robot.
    pub(super) fn push(&mut self, waiting: Waiting) {
        self.waiting += 1;
        let asker = self.askers.join(&waiting.requester.asker);
        asker.waiting += 1;
        let robot = asker.of.join(&waiting.requester.robot);
        robot.waiting += 1;
        robot.of.push_back(waiting);
    }

    /// The changes that are made next, in their order, before others are let in: at most so many, and none
    /// behind one that has yet to be decided on, which may take long.
    pub(super) fn group(&mut self, changes_max: usize) -> Vec<Waiting> {
        let (mut group, mut voxels) = (Vec::new(), 0);
        while group.len() < changes_max && voxels < GROUP_VOXELS_MAX {
            let Some((waiting, of_it)) = self.next() else { break };
            voxels += of_it.unwrap_or(GROUP_VOXELS_MAX);
            group.push(waiting);
        }
        group
    }

    /// Whose turn it is, with the number of its voxels where it is known.
    fn next(&mut self) -> Option<(Waiting, Option<usize>)> {
        let asker_name = self.askers.next(|_| true)?.id.clone();
        self.askers.begin(&asker_name);
        let asker = self.askers.find(&asker_name)?;
        let robot_name = asker.of.next(|_| true)?.id.clone();
        asker.of.begin(&robot_name);
        let robot = asker.of.find(&robot_name)?;
        let waiting = robot.of.pop_front()?;
        robot.waiting -= 1;
        asker.waiting -= 1;
        self.waiting -= 1;
        let voxels = match &waiting.submission {
            Submission::Prepared(prepared) => {
                Some(prepared.change.touched().into_iter().map(|set| set.len()).sum())
            }
            Submission::Undecided(_) | Submission::Shared(_) => None,
        };
        let size = voxels.unwrap_or(LARGE_CHANGE_VOXELS).min(LARGE_CHANGE_VOXELS) as u64;
        let extra = TURN * size / LARGE_CHANGE_VOXELS as u64;
        asker.of.end(&robot_name, extra);
        self.askers.end(&asker_name, extra);
        Some((waiting, voxels))
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::oneshot;

    use super::*;
    use crate::work::Requester;

    /// A change of `robot` of `asker` that is yet to be decided on.
    fn undecided(asker: &str, robot: &str) -> Waiting {
        let requester = Asker::with_key(asker).for_robot(&RobotName::new(robot).unwrap());
        let submission = Submission::Undecided(Box::new(|_, _| Ok(None)));
        Waiting { submission, answer: oneshot::channel().0, requester, _place: None }
    }

    fn robots(group: &[Waiting]) -> Vec<String> {
        let robot = |Requester { robot, .. }: &Requester| {
            robot.as_ref().map_or_else(String::new, RobotName::to_string)
        };
        group.iter().map(|waiting| robot(&waiting.requester)).collect()
    }

    #[test]
    fn who_has_many_robots_keeps_others_waiting_for_no_more_than_two_changes() {
        let mut turns = Turns::default();
        (0..40).for_each(|n| turns.push(undecided("many", &format!("m{n}"))));
        turns.push(undecided("one", "o"));
        let mut order = Vec::new();
        while !turns.is_empty() {
            let group = turns.group(256);
            assert_eq!(group.len(), 1, "others come in behind a decision");
            order.extend(robots(&group));
        }
        assert_eq!(order.len(), 41);
        assert!(order.iter().position(|robot| robot == "o").unwrap() <= 2, "{order:?}");
    }

    #[test]
    fn changes_of_one_robot_keep_their_order() {
        let mut turns = Turns::default();
        let mut callers = Vec::new();
        for robot in ["a", "b"].repeat(5) {
            let (answer, outcome) = oneshot::channel();
            turns.push(Waiting { answer, ..undecided("one", robot) });
            callers.push((robot, outcome));
        }
        let mut made: Vec<Waiting> = Vec::new();
        while !turns.is_empty() {
            made.extend(turns.group(256));
        }
        // Whose answer goes, is told: one after the other, in the order of each robot's changes.
        for robot in ["a", "b"] {
            let mut of_robot =
                callers.iter_mut().filter(|(name, _)| *name == robot).map(|(_, outcome)| outcome);
            for waiting in made.extract_if(.., |waiting| robots(std::slice::from_ref(waiting)) == [robot]) {
                let outcome = of_robot.next().unwrap();
                assert!(matches!(outcome.try_recv(), Err(oneshot::error::TryRecvError::Empty)));
                drop(waiting);
                assert!(matches!(outcome.try_recv(), Err(oneshot::error::TryRecvError::Closed)));
            }
            assert_eq!(of_robot.count(), 0);
        }
    }
}
