//! Whose scans a handle on the service may insert, align and undo.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::error::{Reason, ServiceError};
use crate::request::UndoTarget;
use mrol_map::map::RobotName;

/// The robots in whose names a caller may send and undo scans, and how much more it may undo.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AllowedScans {
    /// The robots; none = every robot.
    pub robots: Option<Arc<BTreeSet<RobotName>>>,
    /// Whether changes may be undone whoever made them: scans named by the revision that they made.
    pub undo_of_others: bool,
    /// Whether a scan may carve because it says so, where the settings of its robot do not: it takes out what others
    /// mapped, and where it stands is the sender's word alone.
    pub carving_on_request: bool,
}

impl Default for AllowedScans {
    /// Scans of every robot, every undo, and carving.
    fn default() -> Self {
        Self { robots: None, undo_of_others: true, carving_on_request: true }
    }
}

impl AllowedScans {
    /// True of a caller that may know the names of all robots: one that is held to no robots, and may do more than
    /// send scans.
    pub(crate) fn may_know_all_robots(&self) -> bool {
        self.robots.is_none() && self.undo_of_others
    }

    /// Asks whether a scan of `robot` may be sent or undone.
    ///
    /// # Errors
    /// `PermissionDenied` with `robot_not_allowed` for another robot.
    pub fn permit(&self, robot: &RobotName) -> Result<(), ServiceError> {
        match &self.robots {
            Some(robots) if !robots.contains(robot) => {
                Err(robot_not_allowed(robots, &format!("robot {}", robot.as_str())))
            }
            _ => Ok(()),
        }
    }

    /// Asks whether a scan of `robot` may say that it carves, where the settings of its robot say whether it does.
    ///
    /// # Errors
    /// `PermissionDenied` with `scope_too_small` for a caller that may send scans alone.
    pub fn permit_carving(
        &self,
        robot: &RobotName,
        requested: Option<bool>,
        by_settings: bool,
    ) -> Result<(), ServiceError> {
        if self.carving_on_request || by_settings || requested != Some(true) {
            return Ok(());
        }
        let robot = robot.as_str();
        let message = format!(
            "carve takes scope write where the settings of robot {robot} do not carve, the key has insert: \
             leave carve out, or let the operator set robots.{robot}.carve"
        );
        Err(ServiceError::new(Reason::ScopeTooSmall, message))
    }

    /// Asks whether `target` may be undone.
    ///
    /// # Errors
    /// `PermissionDenied` with `robot_not_allowed` for scans of other robots, with `scope_too_small` where a caller
    /// that may send scans alone names a revision.
    pub fn permit_undo(&self, target: &UndoTarget) -> Result<(), ServiceError> {
        match (target, &self.robots) {
            (UndoTarget::Scan { robot, .. } | UndoTarget::RobotSince { robot, .. }, _) => self.permit(robot),
            (UndoTarget::Revision(_), Some(robots)) => {
                Err(robot_not_allowed(robots, "a revision, which may be another robot's or a deletion"))
            }
            (UndoTarget::Revision(_), None) if !self.undo_of_others => {
                let message =
                    "Undo of a revision takes scope write, the key has insert: name a robot and its scan";
                Err(ServiceError::new(Reason::ScopeTooSmall, message))
            }
            (UndoTarget::Revision(_), None) => Ok(()),
        }
    }
}

fn robot_not_allowed(robots: &BTreeSet<RobotName>, what: &str) -> ServiceError {
    let names: Vec<_> = robots.iter().map(RobotName::as_str).collect();
    let message = format!("the key is not for {what}: it is for {}", names.join(", "));
    ServiceError::new(Reason::RobotNotAllowed, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::SessionName;

    #[test]
    fn a_caller_undoes_scans_of_its_robots_and_nothing_else() {
        let robot = |name| RobotName::new(name).unwrap();
        let reason =
            |reach: &AllowedScans, target| reach.permit_undo(&target).err().map(|error| error.reason);
        let scan =
            |name| UndoTarget::Scan { robot: robot(name), session: SessionName::default(), scan_id: 1 };
        let since = |name| UndoTarget::RobotSince { robot: robot(name), revision: 1 };
        let own = AllowedScans {
            robots: Some(Arc::new([robot("r1")].into())),
            undo_of_others: false,
            carving_on_request: false,
        };
        assert_eq!([reason(&own, scan("r1")), reason(&own, since("r1"))], [None, None]);
        for other in [scan("r2"), since("r2"), UndoTarget::Revision(1)] {
            assert_eq!(reason(&own, other), Some(Reason::RobotNotAllowed));
        }
        let inserting = AllowedScans { robots: None, undo_of_others: false, carving_on_request: false };
        assert_eq!(reason(&inserting, scan("r2")), None);
        assert_eq!(reason(&inserting, UndoTarget::Revision(1)), Some(Reason::ScopeTooSmall));
        assert_eq!(reason(&AllowedScans::default(), UndoTarget::Revision(1)), None);
    }

    #[test]
    fn a_caller_that_sends_scans_alone_carves_where_the_settings_of_its_robot_say_so() {
        let robot = RobotName::new("r1").unwrap();
        let inserting = AllowedScans { carving_on_request: false, ..AllowedScans::default() };
        let reason = |requested, by_settings| {
            inserting.permit_carving(&robot, requested, by_settings).err().map(|error| error.reason)
        };
        assert_eq!(reason(Some(true), false), Some(Reason::ScopeTooSmall));
        for (requested, by_settings) in
            [(Some(true), true), (None, true), (None, false), (Some(false), false)]
        {
            assert_eq!(reason(requested, by_settings), None);
        }
        assert!(AllowedScans::default().permit_carving(&robot, Some(true), false).is_ok());
    }
}
