//! Where and when robots were last seen.

use std::collections::HashMap;
use std::time::SystemTime;

use super::located_scan::LocatedScan;
use super::scan::Scan;
use crate::align::Verdict;
use crate::geometry::Pose;
use crate::map::{MappedScan, RobotName};
use crate::sync::{Mutex, Rank};

/// Robots whose last sighting is remembered, at most; beyond, the one goes that was seen longest ago.
pub const SIGHTINGS_MAX: usize = 4096;

/// The last sighting of each robot, in memory.
///
/// A scan of a robot that stands still is accepted and not stored (see
/// [`StationarySettings`](super::StationarySettings)), so that its trajectory ends where it stopped. The guess for its
/// next scan has to know that it stood: otherwise its last motion would be extrapolated over all the time since.
/// Operators see here when a robot was last heard of, and whether its scans fit.
#[derive(Debug)]
pub struct Sightings(Mutex<HashMap<RobotName, Entry>>);

/// A robot as its last scan showed it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// The robot.
    pub robot: RobotName,
    /// When the scan was judged, by the clock of this machine.
    pub seen_at: SystemTime,
    /// When it was taken, nanoseconds since the Unix epoch, where it tells.
    pub timestamp_ns: Option<i64>,
    /// Where the robot was: map_from_sensor. Of a scan that did not fit, where its alignment ended.
    pub map_from_sensor: Pose,
    /// Whether the scan fits the map there.
    pub verdict: Verdict,
    /// The robot stood where its last stored scan was taken, and saw nothing new.
    pub is_stationary: bool,
}

#[derive(Debug, Clone)]
struct Entry {
    last: Sighting,
    standing: Option<Standing>,
    /// The scan that was accepted last came right after one that was refused.
    follows_refused: bool,
}

/// A robot that was seen standing still.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Standing {
    /// Revision of the robot's last stored scan. Once it has another one, this is void.
    after: u64,
    /// Where the robot was: map_from_sensor.
    pub(super) map_from_sensor: Pose,
    /// When, nanoseconds since the Unix epoch, where its scan tells.
    pub(super) timestamp_ns: Option<i64>,
}

impl Default for Sightings {
    fn default() -> Self {
        Self(Mutex::new(Rank::Brief, HashMap::new()))
    }
}

impl Sightings {
    /// Notes where a scan of a robot was found, and whether it fits there.
    pub fn note(&self, scan: &Scan<'_>, located: &LocatedScan) {
        let last = Sighting {
            robot: scan.robot.clone(),
            seen_at: SystemTime::now(),
            timestamp_ns: scan.timestamp_ns,
            map_from_sensor: located.alignment.map_from_sensor,
            verdict: located.alignment.verdict,
            is_stationary: false,
        };
        let mut all = self.0.lock();
        if let Some(entry) = all.get_mut(scan.robot) {
            if last.verdict == Verdict::Accepted {
                entry.follows_refused = entry.last.verdict != Verdict::Accepted;
            }
            entry.last = last;
            return;
        }
        if all.len() >= SIGHTINGS_MAX {
            let longest_ago = all.iter().min_by_key(|(_, entry)| entry.last.seen_at);
            if let Some(robot) = longest_ago.map(|(robot, _)| robot.clone()) {
                all.remove(&robot);
            }
        }
        all.insert(scan.robot.clone(), Entry { last, standing: None, follows_refused: false });
    }

    /// Notes that the scan of a robot that was noted last, whose last stored scan is `last`, shows it standing still.
    pub(super) fn note_standing(&self, last: &MappedScan, map_from_sensor: Pose, timestamp_ns: Option<i64>) {
        if let Some(entry) = self.0.lock().get_mut(&last.robot) {
            entry.last.is_stationary = true;
            entry.standing = Some(Standing { after: last.revision, map_from_sensor, timestamp_ns });
        }
    }

    /// Where a robot was last seen standing still since its last stored scan, which is `last`.
    pub(super) fn standing_since(&self, last: &MappedScan) -> Option<Standing> {
        let standing = self.0.lock().get(&last.robot)?.standing;
        standing.filter(|standing| standing.after == last.revision)
    }

    /// True of a robot whose last accepted scan came right after a refused one: from the one accepted before to it no
    /// velocity is taken, since it may have been placed too far along.
    pub(super) fn follows_refused(&self, robot: &RobotName) -> bool {
        self.0.lock().get(robot).is_some_and(|entry| entry.follows_refused)
    }

    /// The last sighting of each robot, by name.
    pub fn to_vec(&self) -> Vec<Sighting> {
        let mut all: Vec<_> = self.0.lock().values().map(|entry| entry.last.clone()).collect();
        all.sort_unstable_by(|a, b| a.robot.cmp(&b.robot));
        all
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::align::Alignment;
    use crate::geometry::Point;

    fn robot(n: usize) -> RobotName {
        RobotName::new(&format!("r{n}")).unwrap()
    }

    fn seen(sightings: &Sightings, robot: &RobotName, verdict: Verdict) {
        let points = [Point::new(1.0, 0.0, 0.0)];
        let alignment = Alignment { verdict, ..Alignment::trusted(Pose::identity(), 1, &points) };
        let located = LocatedScan {
            guess: Pose::identity(),
            alignment,
            align_time: Duration::ZERO,
            is_first: false,
            velocity: None,
            recovered: None,
        };
        sightings.note(&Scan::new(robot, &points), &located);
    }

    #[test]
    fn a_robot_stands_still_until_another_scan_is_stored() {
        let robot = robot(1);
        let kept = |revision| MappedScan { revision, ..MappedScan::new(robot.clone(), Pose::identity()) };
        let sightings = Sightings::default();
        assert_eq!(sightings.standing_since(&kept(3)), None);
        seen(&sightings, &robot, Verdict::Accepted);
        sightings.note_standing(&kept(3), Pose::translation(0.01, 0.0, 0.0), Some(7));
        // A scan in between that does not fit tells nothing of where it stands.
        seen(&sightings, &robot, Verdict::LowOverlap);
        assert_eq!(sightings.standing_since(&kept(3)).unwrap().timestamp_ns, Some(7));
        assert_eq!(sightings.to_vec()[0].verdict, Verdict::LowOverlap);
        assert_eq!(sightings.standing_since(&kept(4)), None);
        // The scan after it was undone: what was seen since the one before it is not known.
        assert_eq!(sightings.standing_since(&kept(2)), None);
    }

    #[test]
    fn a_scan_that_is_accepted_after_a_refused_one_tells_no_velocity_and_the_next_one_does() {
        let (sightings, robot) = (Sightings::default(), robot(1));
        let follows = |verdict| {
            seen(&sightings, &robot, verdict);
            sightings.follows_refused(&robot)
        };
        assert!(!follows(Verdict::Accepted) && !follows(Verdict::Accepted));
        assert!(!follows(Verdict::Ambiguous), "the two before it are as they were");
        assert!(follows(Verdict::Accepted) && !follows(Verdict::Accepted));
    }

    #[test]
    fn beyond_the_bound_the_robot_goes_that_was_seen_longest_ago() {
        let sightings = Sightings::default();
        (0..SIGHTINGS_MAX).for_each(|n| seen(&sightings, &robot(n), Verdict::Accepted));
        seen(&sightings, &robot(0), Verdict::Accepted);
        seen(&sightings, &robot(SIGHTINGS_MAX), Verdict::Accepted);
        let names: Vec<_> = sightings.to_vec().into_iter().map(|sighting| sighting.robot).collect();
        assert_eq!(names.len(), SIGHTINGS_MAX);
        assert!(names.contains(&robot(0)) && names.contains(&robot(SIGHTINGS_MAX)));
        assert!(!names.contains(&robot(1)));
    }
}
