//! Robots whose scans a map refuses: when that begins, and when it ends, however many scans lie between.

use std::collections::{BTreeMap, HashMap};
use std::time::Instant;

use parking_lot::Mutex;

use super::line_limit::LineLimit;
use mrol_map::map::{CallerName, MapName, RobotName};

/// Robots of a caller that are remembered, on all maps: of more the oldest is forgotten, and its next refusal is the
/// first again.
const OF_CALLER_MAX: usize = 1_024;

/// The robots whose last scan was refused, caller by caller: none pushes out the lines of another's robots.
#[derive(Debug, Default)]
pub(super) struct RefusedRobots(Mutex<BTreeMap<Option<CallerName>, OfCaller>>);

/// The robots of one caller.
#[derive(Debug, Default)]
struct OfCaller {
    lines: LineLimit,
    robots: HashMap<(MapName, RobotName), Refusals>,
}

/// Refusals of one robot, one after another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refusals {
    /// How many.
    pub(super) scans: u64,
    /// When the first was told.
    pub(super) since: Instant,
    /// True where a line was written of the first.
    is_written: bool,
}

impl RefusedRobots {
    /// A scan was refused. Some where a line is to be written: of the first after one that was accepted, or after none.
    /// It has the number of lines before it that were not.
    pub(super) fn refused(
        &self,
        caller: Option<&CallerName>,
        map: &MapName,
        robot: &RobotName,
    ) -> Option<u64> {
        let (mut callers, of) = (self.0.lock(), (map.clone(), robot.clone()));
        let OfCaller { lines, robots } = callers.entry(caller.cloned()).or_default();
        if let Some(refusals) = robots.get_mut(&of) {
            refusals.scans += 1;
            return None;
        }
        if robots.len() >= OF_CALLER_MAX {
            let oldest = robots.iter().min_by_key(|(_, refusals)| refusals.since);
            let oldest = oldest.map(|(of, _)| of.clone());
            oldest.and_then(|of| robots.remove(&of));
        }
        let unwritten = lines.to_write();
        robots.insert(of, Refusals { scans: 1, since: Instant::now(), is_written: unwritten.is_some() });
        unwritten
    }

    /// A scan was accepted; the refusals before it, where a line was written of them.
    pub(super) fn accepted(
        &self,
        caller: Option<&CallerName>,
        map: &MapName,
        robot: &RobotName,
    ) -> Option<Refusals> {
        let mut callers = self.0.lock();
        let OfCaller { robots, .. } = callers.get_mut(&caller.cloned())?;
        robots.remove(&(map.clone(), robot.clone())).filter(|refusals| refusals.is_written)
    }

    /// The map has another name, or is another, or gone.
    pub(super) fn forget(&self, map: &MapName, renamed_to: Option<&MapName>) {
        for OfCaller { robots, .. } in self.0.lock().values_mut() {
            let moved: Vec<_> = robots.extract_if(|(of, _), _| of == map).collect();
            let renamed = moved
                .into_iter()
                .filter_map(|((_, robot), refusals)| Some(((renamed_to?.clone(), robot), refusals)));
            robots.extend(renamed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot(i: usize) -> RobotName {
        RobotName::new(&format!("r{i}")).unwrap()
    }

    fn map(name: &str) -> MapName {
        MapName::new(name).unwrap()
    }

    #[test]
    fn a_row_of_refusals_begins_once_and_ends_once() {
        let (robots, a, b) = (RefusedRobots::default(), map("a"), map("b"));
        let told: Vec<_> = (0..3).map(|_| robots.refused(None, &a, &robot(1))).collect();
        assert_eq!(told, [Some(0), None, None]);
        assert_eq!(robots.refused(None, &a, &robot(2)), Some(0), "another robot");
        assert_eq!(robots.accepted(None, &a, &robot(1)).map(|row| row.scans), Some(3));
        assert!(robots.accepted(None, &a, &robot(1)).is_none());
        assert_eq!(robots.refused(None, &a, &robot(1)), Some(0));
        robots.forget(&a, Some(&b));
        assert_eq!(robots.accepted(None, &b, &robot(1)).map(|row| row.scans), Some(1));
        robots.forget(&b, None);
        assert!(robots.accepted(None, &b, &robot(2)).is_none());
    }

    #[test]
    fn no_number_of_names_pushes_out_the_robots_of_another_caller_or_makes_it_grow() {
        let (robots, a, honest) = (RefusedRobots::default(), map("a"), CallerName::new("honest").unwrap());
        assert_eq!(robots.refused(Some(&honest), &a, &robot(0)), Some(0));
        let lines = (0..5 * OF_CALLER_MAX).filter(|&i| robots.refused(None, &a, &robot(i)).is_some()).count();
        assert!(lines < OF_CALLER_MAX, "{lines} lines");
        assert_eq!(robots.0.lock()[&None].robots.len(), OF_CALLER_MAX);
        assert_eq!(robots.accepted(Some(&honest), &a, &robot(0)).map(|row| row.scans), Some(1));
        // What ends without a line of its begin has none of its end.
        assert!(robots.accepted(None, &a, &robot(5 * OF_CALLER_MAX - 1)).is_none());
        assert_eq!(robots.refused(Some(&honest), &a, &robot(0)), Some(0));
    }
}
