//! Whom a request counts for, where callers take turns.

use std::fmt::{Display, Formatter, Result as FmtResult};
use std::sync::Arc;

use mrol_map::map::RobotName;

/// Whom a request counts for: a key, or the place that it came from where there is none. By default that of what the
/// process does itself.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Asker(Arc<str>);

impl Asker {
    /// The holder of the key of this name.
    pub fn with_key(name: &str) -> Self {
        Self(format!("key {name}").into())
    }

    /// Somebody without a key, at this place.
    pub fn at(place: impl Display) -> Self {
        Self(place.to_string().into())
    }

    /// What it is called in refusals.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The same asker, for one of its robots.
    pub(crate) fn for_robot(&self, robot: &RobotName) -> Requester {
        Requester { asker: self.clone(), robot: Some(robot.clone()) }
    }
}

impl Default for Asker {
    fn default() -> Self {
        Self::at("somebody")
    }
}

impl Display for Asker {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        f.write_str(&self.0)
    }
}

/// Whose turn a job takes: an asker takes turns with other askers, and each of its robots with its other robots.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Requester {
    pub(crate) asker: Asker,
    /// None of requests that are of no robot, which take turns with the asker's robots as one of them.
    pub(crate) robot: Option<RobotName>,
}

impl From<&Asker> for Requester {
    fn from(asker: &Asker) -> Self {
        Self { asker: asker.clone(), robot: None }
    }
}

impl From<&Requester> for Requester {
    fn from(requester: &Requester) -> Self {
        requester.clone()
    }
}
