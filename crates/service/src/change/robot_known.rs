//! Whether a map knows the robot whose scans are to be undone.

use crate::error::{Reason, ServiceError};
use crate::maps::HostedMap;
use crate::request::{EventsQuery, UndoTarget};
use mrol_map::map::RobotName;

/// Names of robots in an error message; of more, their number.
const ROBOTS_NAMED_MAX: usize = 8;

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
    let names: Vec<_> = robots.iter().take(ROBOTS_NAMED_MAX).map(RobotName::as_str).collect();
    let more = robots.len() - names.len();
    match (names.len(), more) {
        (0, _) => "it has scans of no robot".to_owned(),
        (_, 0) => format!("it has scans of {}", names.join(", ")),
        _ => format!("it has scans of {} and {more} more", names.join(", ")),
    }
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
}
