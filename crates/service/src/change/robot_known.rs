//! Whether a map knows the robot whose scans are to be undone, and in which sessions it has a scan.

use crate::error::{Reason, ServiceError};
use crate::maps::HostedMap;
use crate::request::{EventsQuery, UndoTarget};
use mrol_map::map::{RobotName, SessionName};

/// Names of robots in an error message; of more, their number.
const ROBOTS_NAMED_MAX: usize = 8;

/// The same of sessions, whose names are long.
const SESSIONS_NAMED_MAX: usize = 4;

impl HostedMap {
    /// Refuses an undo of scans of a robot that never sent one to this map, most likely a misspelled name. Where
    /// `names_robots`, the error names the robots that have scans in the map.
    ///
    /// # Errors
    /// `NotFound` with `robot_not_found`.
    pub(super) fn check_robot_known(
        &self,
        target: &UndoTarget,
        names_robots: bool,
    ) -> Result<(), ServiceError> {
        let robot = match target {
            UndoTarget::Scan { robot, .. } | UndoTarget::RobotSince { robot, .. } => robot,
            UndoTarget::Revision(_) => return Ok(()),
        };
        let query = EventsQuery { since_number: 0, robot: Some(robot.clone()) };
        let trajectory = self.map.trajectory();
        // A robot whose scans were all refused, or undone long ago, sent scans all the same.
        if trajectory.knows(robot) || !self.robots.events.list(&query).is_empty() {
            return Ok(());
        }
        let known = if names_robots { format!(": {}", listed(&trajectory.robots())) } else { String::new() };
        let message = format!("map {} knows no robot {}{known}", self.name, robot.as_str());
        Err(ServiceError::new(Reason::RobotNotFound, message))
    }
}

/// The robots of a map, in words.
fn listed(robots: &[RobotName]) -> String {
    if robots.is_empty() {
        return "it has scans of no robot".to_owned();
    }
    format!("it has scans of {}", named(robots.iter().map(RobotName::as_str), ROBOTS_NAMED_MAX))
}

/// The sessions in which a robot has a scan of the id that was looked for in another one, in words; nothing where there
/// are none.
pub(super) fn listed_sessions(sessions: &[&SessionName]) -> String {
    let names = sessions.iter().map(|name| if name.is_empty() { "the empty one" } else { name.as_str() });
    match sessions.len() {
        0 => String::new(),
        1 => {
            format!("; the robot has one of this id in another session: {}", named(names, SESSIONS_NAMED_MAX))
        }
        _ => {
            format!("; the robot has some of this id in other sessions: {}", named(names, SESSIONS_NAMED_MAX))
        }
    }
}

/// The first `most` of these names, and how many more there are.
fn named<'n>(names: impl ExactSizeIterator<Item = &'n str>, most: usize) -> String {
    let more = names.len().saturating_sub(most);
    let first = names.take(most).collect::<Vec<_>>().join(", ");
    if more == 0 { first } else { format!("{first} and {more} more") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_robots_are_counted_and_few_are_named() {
        let robots = |count: usize| -> Vec<_> {
            (0..count).map(|n| RobotName::new(&format!("r{n}")).unwrap()).collect()
        };
        assert_eq!(listed(&robots(0)), "it has scans of no robot");
        assert_eq!(listed(&robots(2)), "it has scans of r0, r1");
        let named = "it has scans of r0, r1, r2, r3, r4, r5, r6, r7";
        assert_eq!(
            (listed(&robots(8)), listed(&robots(10))),
            (named.to_owned(), format!("{named} and 2 more"))
        );
    }

    #[test]
    fn many_sessions_are_counted_and_few_are_named() {
        let sessions: Vec<_> = ["", "a", "b", "c", "d"].map(|name| SessionName::new(name).unwrap()).into();
        let listed = |count: usize| listed_sessions(&sessions.iter().take(count).collect::<Vec<_>>());
        assert_eq!(listed(0), "");
        assert_eq!(listed(1), "; the robot has one of this id in another session: the empty one");
        let named = "; the robot has some of this id in other sessions: the empty one, a, b, c";
        assert_eq!((listed(4), listed(5)), (named.to_owned(), format!("{named} and 1 more")));
    }
}
