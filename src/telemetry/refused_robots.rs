//! Robots whose scans a map refuses: when that begins, and when it ends, however many scans lie between.

use std::collections::HashMap;
use std::time::Instant;

use parking_lot::Mutex;

use mrol_map::map::{MapName, RobotName};

/// Robots of all maps that are remembered. The refusals of further ones are each taken for the first.
const REMEMBERED_MAX: usize = 4_096;

/// The robots of each map whose last scan was refused.
#[derive(Debug, Default)]
pub(super) struct RefusedRobots(Mutex<HashMap<(MapName, RobotName), Refusals>>);

/// Refusals of one robot, one after another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refusals {
    /// How many.
    pub(super) scans: u64,
    /// When the first was told.
    pub(super) since: Instant,
}

impl RefusedRobots {
    /// Another scan was refused; true where the one before was accepted, or there is none.
    pub(super) fn refused(&self, map: &MapName, robot: &RobotName) -> bool {
        let (mut robots, of) = (self.0.lock(), (map.clone(), robot.clone()));
        if let Some(refusals) = robots.get_mut(&of) {
            refusals.scans += 1;
            return false;
        }
        if robots.len() < REMEMBERED_MAX {
            robots.insert(of, Refusals { scans: 1, since: Instant::now() });
        }
        true
    }

    /// A scan was accepted; the refusals before it, where there are any.
    pub(super) fn accepted(&self, map: &MapName, robot: &RobotName) -> Option<Refusals> {
        self.0.lock().remove(&(map.clone(), robot.clone()))
    }

    /// The map is another, or gone.
    pub(super) fn forget(&self, map: &MapName) {
        self.0.lock().retain(|(of, _), _| of != map);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot(i: usize) -> RobotName {
        RobotName::new(&format!("r{i}")).unwrap()
    }

    #[test]
    fn a_row_of_refusals_begins_once_and_ends_once() {
        let (robots, map) = (RefusedRobots::default(), MapName::new("a").unwrap());
        let told: Vec<bool> = (0..3).map(|_| robots.refused(&map, &robot(1))).collect();
        assert_eq!(told, [true, false, false]);
        assert!(robots.refused(&map, &robot(2)), "another robot");
        assert_eq!(robots.accepted(&map, &robot(1)).map(|row| row.scans), Some(3));
        assert!(robots.accepted(&map, &robot(1)).is_none() && robots.refused(&map, &robot(1)));
        robots.forget(&map);
        assert!(robots.accepted(&map, &robot(2)).is_none());
    }

    #[test]
    fn no_number_of_robots_makes_it_grow() {
        let (robots, map) = (RefusedRobots::default(), MapName::new("a").unwrap());
        assert!((0..2 * REMEMBERED_MAX).all(|i| robots.refused(&map, &robot(i))));
        assert_eq!(robots.0.lock().len(), REMEMBERED_MAX);
    }
}
