//! The robots of a map: what is known of them besides the poses of their scans.

use std::collections::HashMap;
use std::sync::Arc;

use tokio::sync::OwnedMutexGuard;

use super::event_log::EventLog;
use super::newcomers::Newcomers;
use mrol_map::map::RobotName;
use mrol_map::mapping::{LostRobots, Sightings};
use mrol_map::sync::{Mutex, Rank};

/// Robots whose locks are remembered before those that nobody waits for are dropped.
const LOCKS_KEPT: usize = 1024;

/// The robots that send scans to a map.
#[derive(Debug)]
pub(crate) struct Robots {
    /// One robot's scans are taken in order.
    locks: Mutex<HashMap<RobotName, Arc<tokio::sync::Mutex<()>>>>,
    /// Where and when robots were last seen.
    pub(crate) sightings: Sightings,
    /// Robots whose scans are refused, and that want to be looked for.
    pub(crate) lost: LostRobots,
    /// What became of the last scans that robots sent.
    pub(crate) events: EventLog,
    /// The callers that brought robots in.
    pub(crate) newcomers: Newcomers,
}

impl Default for Robots {
    fn default() -> Self {
        Self {
            locks: Mutex::new(Rank::Brief, HashMap::new()),
            sightings: Sightings::default(),
            lost: LostRobots::default(),
            events: EventLog::default(),
            newcomers: Newcomers::default(),
        }
    }
}

impl Robots {
    /// Waits until the robot's earlier scans are done.
    pub(crate) async fn lock_robot(&self, robot: &RobotName) -> OwnedMutexGuard<()> {
        let lock = {
            let mut locks = self.locks.lock();
            if locks.len() >= LOCKS_KEPT {
                locks.retain(|_, lock| Arc::strong_count(lock) > 1);
            }
            Arc::clone(locks.entry(robot.clone()).or_default())
        };
        lock.lock_owned().await
    }
}
