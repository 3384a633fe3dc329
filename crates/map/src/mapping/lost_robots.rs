//! Robots that are lost: what is remembered of them until they are found.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::align::localize::{Gravity, LocalizationQuery};
use crate::geometry::{Point, Pose};
use crate::map::{RobotName, SessionName};
use crate::sync::{Mutex, Rank};

/// Lost robots that are remembered, at most; beyond, one goes that has no scan in the map, or else the one whose last
/// scan came longest ago.
pub const LOST_ROBOTS_MAX: usize = 64;

/// For how long a robot is remembered whose scans no longer come.
const REMEMBERED_FOR: Duration = Duration::from_secs(600);

/// The robots whose last scan was refused, in memory.
#[derive(Debug)]
pub struct LostRobots(Mutex<All>);

#[derive(Debug, Default)]
struct All {
    robots: HashMap<RobotName, Lost>,
    /// Searches begun so far.
    searches: u64,
}

/// Since when a robot is lost. What is remembered of it is void once it restarted, or a scan of it was stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LostSince {
    pub(super) session: SessionName,
    /// The revision of its last stored scan.
    pub(super) stored: Option<u64>,
}

/// A robot whose last scan was refused.
#[derive(Debug, Clone)]
pub(super) struct LostRobot {
    /// Points of its last scan, sensor frame, meters.
    pub(super) points: Arc<[Point]>,
    /// When that was taken, nanoseconds since the Unix epoch.
    pub(super) timestamp_ns: Option<i64>,
    /// Where its refused scans lead, one aligned to the other: map_from_sensor of the last one.
    pub(super) chained: Pose,
    /// Where a search saw it, moved on by its motion since: map_from_sensor of its last scan.
    pub(super) place: Option<Pose>,
}

#[derive(Debug)]
struct Lost {
    robot: LostRobot,
    since: LostSince,
    /// Which way was down at its last scan.
    gravity: Option<Gravity>,
    noted_at: Instant,
    /// Searches begun for this robot.
    searches: u64,
    searched_at: Option<Instant>,
    under_way: Option<UnderWay>,
    /// What the last search said.
    news: Option<String>,
}

/// A search under way.
#[derive(Debug)]
struct UnderWay {
    number: u64,
    /// The robot's motion since the scan that is searched for: searched_from_last. None where it is not known.
    since: Option<Pose>,
}

/// A search that is to be made for a lost robot.
#[derive(Debug, Clone)]
pub struct SearchTask {
    number: u64,
    robot: RobotName,
    /// Points of the scan to search for, sensor frame, meters.
    pub(super) points: Arc<[Point]>,
    pub(super) query: LocalizationQuery,
}

impl Default for LostRobots {
    fn default() -> Self {
        Self(Mutex::new(Rank::Brief, All::default()))
    }
}

/// A refused scan.
#[derive(Debug)]
pub(super) struct RefusedScan<'a> {
    pub(super) robot: &'a RobotName,
    pub(super) since: LostSince,
    pub(super) timestamp_ns: Option<i64>,
    pub(super) gravity: Option<Gravity>,
    /// Its points, sensor frame, meters.
    pub(super) points: Vec<Point>,
    /// Motion of the sensor since the refused scan before it: before_from_now. None where there is none, or it is not
    /// known.
    pub(super) motion: Option<Pose>,
    /// Where it was taken if it is the first one: map_from_sensor.
    pub(super) probable_pose: Pose,
    /// The place of a search was looked at, and the scan is not there.
    pub(super) is_not_in_place: bool,
}

impl Lost {
    fn is_forgotten(&self) -> bool {
        self.noted_at.elapsed() > REMEMBERED_FOR
    }
}

impl LostRobots {
    /// The robot, if it is lost since then.
    pub(super) fn get(&self, robot: &RobotName, since: &LostSince) -> Option<LostRobot> {
        let all = self.0.lock();
        let lost = all.robots.get(robot).filter(|lost| lost.since == *since && !lost.is_forgotten());
        lost.map(|lost| lost.robot.clone())
    }

    /// Forgets the robots whose scans no longer come.
    pub fn forget_old(&self) {
        self.0.lock().robots.retain(|_, lost| !lost.is_forgotten());
    }

    /// What the last search for the robot said.
    pub(super) fn news(&self, robot: &RobotName) -> Option<String> {
        self.0.lock().robots.get(robot)?.news.clone()
    }

    /// The robot is lost no longer.
    pub fn found(&self, robot: &RobotName) {
        self.0.lock().robots.remove(robot);
    }

    /// Notes a refused scan.
    pub(super) fn note(&self, scan: RefusedScan<'_>) {
        let RefusedScan { robot, since, timestamp_ns, gravity, motion, probable_pose, .. } = scan;
        let points = scan.points.into();
        let mut all = self.0.lock();
        all.robots.retain(|_, lost| !lost.is_forgotten());
        if let Some(lost) = all.robots.get_mut(robot).filter(|lost| lost.since == since) {
            lost.gravity = gravity;
            let moved = |pose: Pose| motion.map(|motion| pose * motion);
            let place = lost.robot.place.filter(|_| !scan.is_not_in_place).and_then(moved);
            let chained = moved(lost.robot.chained).unwrap_or(lost.robot.chained);
            lost.robot = LostRobot { points, timestamp_ns, chained, place };
            lost.noted_at = Instant::now();
            if let Some(search) = &mut lost.under_way {
                search.since = search.since.and_then(moved);
            }
            return;
        }
        if all.robots.len() >= LOST_ROBOTS_MAX && !all.robots.contains_key(robot) {
            // Names that the map does not know are easily made up.
            let first =
                all.robots.iter().min_by_key(|(_, lost)| (lost.since.stored.is_some(), lost.noted_at));
            if let Some(robot) = first.map(|(robot, _)| robot.clone()) {
                all.robots.remove(&robot);
            }
        }
        let lost = Lost {
            since,
            gravity,
            robot: LostRobot { points, timestamp_ns, chained: probable_pose, place: None },
            noted_at: Instant::now(),
            searches: 0,
            searched_at: None,
            under_way: None,
            news: None,
        };
        all.robots.insert(robot.clone(), lost);
    }

    /// Begins a search for the scan of the robot that was noted last: one at a time, and no sooner after the one before
    /// it than `interval`. `query` is told how many searches for the robot there are with it, when that scan was taken
    /// and which way was down.
    pub(super) fn begin_search(
        &self,
        robot: &RobotName,
        interval: Duration,
        query: impl FnOnce(u64, Option<i64>, Option<Gravity>) -> LocalizationQuery,
    ) -> Option<SearchTask> {
        let mut all = self.0.lock();
        let All { robots, searches } = &mut *all;
        let lost = robots.get_mut(robot)?;
        let is_early = lost.searched_at.is_some_and(|at| at.elapsed() < interval);
        if lost.under_way.is_some() || lost.robot.place.is_some() || is_early {
            return None;
        }
        *searches += 1;
        lost.searches += 1;
        lost.searched_at = Some(Instant::now());
        lost.under_way = Some(UnderWay { number: *searches, since: Some(Pose::identity()) });
        let (number, points) = (*searches, Arc::clone(&lost.robot.points));
        let (of_robot, timestamp_ns, gravity) = (lost.searches, lost.robot.timestamp_ns, lost.gravity);
        drop(all);
        let query = query(of_robot, timestamp_ns, gravity);
        Some(SearchTask { number, robot: robot.clone(), points, query })
    }

    /// Ends a search, which found the scan at a place (map_from_sensor), or tells why not.
    pub(super) fn end_search(&self, task: &SearchTask, found: Result<Pose, String>) {
        let mut all = self.0.lock();
        // The robot may have been found meanwhile, and have lost itself again.
        let Some(lost) = all.robots.get_mut(&task.robot) else { return };
        let Some(search) = lost.under_way.take_if(|search| search.number == task.number) else { return };
        lost.news = Some(match &found {
            Ok(_) => "found at one place, which the next scan has to confirm".into(),
            Err(reason) => reason.clone(),
        });
        lost.robot.place = found.ok().zip(search.since).map(|(place, since)| place * since);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str) -> RobotName {
        RobotName::new(text).unwrap()
    }

    fn since(session: &str, stored: Option<u64>) -> LostSince {
        LostSince { session: SessionName::new(session).unwrap(), stored }
    }

    fn refuse(lost: &LostRobots, robot: &RobotName, since: LostSince) {
        lost.note(RefusedScan {
            robot,
            since,
            timestamp_ns: None,
            gravity: None,
            points: vec![Point::new(1.0, 0.0, 0.0)],
            motion: None,
            probable_pose: Pose::identity(),
            is_not_in_place: false,
        });
    }

    #[test]
    fn what_is_remembered_is_void_after_a_restart_and_after_a_stored_scan() {
        let (lost, robot) = (LostRobots::default(), name("r"));
        refuse(&lost, &robot, since("a", Some(3)));
        assert!(lost.get(&robot, &since("a", Some(3))).is_some());
        for other in [since("b", Some(3)), since("a", Some(4)), since("a", None)] {
            assert!(lost.get(&robot, &other).is_none(), "{other:?}");
        }
        // Nor does a search that began before say anything of it afterwards.
        let task = lost.begin_search(&robot, Duration::ZERO, |_, _, _| LocalizationQuery::default()).unwrap();
        refuse(&lost, &robot, since("a", Some(5)));
        lost.end_search(&task, Ok(Pose::identity()));
        assert!(lost.get(&robot, &since("a", Some(5))).unwrap().place.is_none());
        lost.found(&robot);
        assert!(lost.get(&robot, &since("a", Some(5))).is_none());
    }

    #[test]
    fn names_that_the_map_does_not_know_take_no_place_from_robots_that_it_knows() {
        let (lost, robot) = (LostRobots::default(), name("r"));
        refuse(&lost, &robot, since("", Some(1)));
        for k in 0..3 * LOST_ROBOTS_MAX {
            refuse(&lost, &name(&format!("made-up-{k}")), since("", None));
        }
        assert!(lost.get(&robot, &since("", Some(1))).is_some());
        assert_eq!(lost.0.lock().robots.len(), LOST_ROBOTS_MAX);
    }
}
