//! The search for a lost robot.

use std::time::Instant;

use nalgebra::Vector3;

use crate::align::Verdict;
use crate::align::localize::{
    Gravity, Localization, LocalizationError, LocalizationQuery, MAP_DOWN, SearchBox, Supervision,
    localize_supervised,
};
use crate::geometry::{Pose, translation_m};
use crate::map::RobotName;
use crate::mapping::located_scan::LocatedScan;
use crate::mapping::lost_robots::{LostRobots, SearchTask};
use crate::mapping::recovery_settings::KINDS_OF_SEARCH;
use crate::mapping::scan::Scan;
use crate::mapping::scan_mapper::ScanMapper;
use crate::util::StopSignal;

/// Candidates that a search compares: a rival is enough to say no.
const CANDIDATES: usize = 2;

impl ScanMapper<'_> {
    /// What to search for after a scan of `robot` was refused. None where the robot is not lost, a place that a search
    /// found is to be confirmed first, or a search is under way or was not long ago. Whoever takes it has to
    /// [search](Self::search).
    pub fn begin_search(&self, robot: &RobotName) -> Option<SearchTask> {
        let recovery = self.recovery?;
        let query = |number, timestamp_ns, gravity: Option<Gravity>| {
            let query = self.search_query(robot, timestamp_ns, number);
            LocalizationQuery { gravity: gravity.or(query.gravity), ..query }
        };
        recovery.lost.begin_search(robot, recovery.settings.search_interval, query)
    }

    /// Searches for a lost robot with no guess. What is found is not believed yet: the robot's next scan has to confirm
    /// it.
    ///
    /// # Errors
    /// As for [`localize`](crate::align::localize::localize).
    pub fn search(
        &self,
        task: &SearchTask,
        supervision: &mut Supervision<'_>,
    ) -> Result<(), LocalizationError> {
        let Some(recovery) = self.recovery else { return Ok(()) };
        let mut ending = Ending { lost: recovery.lost, task, found: Err("it was given up".into()) };
        let found = localize_supervised(
            self.map,
            &task.points,
            &task.query,
            &recovery.settings.search(),
            &self.settings.alignment,
            supervision,
        );
        ending.found = found.as_ref().map_err(ToString::to_string).and_then(place_of);
        found.map(drop)
    }

    /// Searches for the robot of a refused scan at once, and for as long as it takes; returns the scan as it was
    /// located, with that time. The next scan has to confirm what is found: in a mirror, along shelves and before a
    /// blank wall the same scan fits at a wrong place as well.
    pub(in crate::mapping) fn search_at_once(
        &self,
        scan: &Scan<'_>,
        located: LocatedScan,
        stop: StopSignal<'_>,
    ) -> LocatedScan {
        let start = Instant::now();
        for _ in 0..self.kinds_of_search(scan) {
            let Some(task) = self.begin_search(scan.robot) else { break };
            let alone =
                &mut Supervision { stop, search_stop: stop, progress: &mut |_| (), reserve: &mut |_| true };
            // An error is noted with the robot, and told with the scan.
            drop(self.search(&task, alone));
        }
        LocatedScan { align_time: located.align_time + start.elapsed(), ..located }
    }

    /// How many kinds of search differ for a scan: one where it tells which way is down, or its robot was never seen.
    fn kinds_of_search(&self, scan: &Scan<'_>) -> u64 {
        let keeps_tilt = self.recovery.is_some_and(|recovery| recovery.settings.keeps_tilt);
        let differ = keeps_tilt && scan.gravity.is_none() && self.last_good(scan.robot).is_some();
        if differ { KINDS_OF_SEARCH } else { 1 }
    }

    /// A refused scan with what the last search for its robot said.
    #[must_use]
    pub fn told(&self, scan: &Scan<'_>, located: LocatedScan) -> LocatedScan {
        if located.is_accepted() {
            return located;
        }
        let Some(news) = self.recovery.and_then(|recovery| recovery.lost.news(scan.robot)) else {
            return located;
        };
        let reason = format!("{}; a search with no guess: {news}", located.alignment.reason);
        let verdict = located.alignment.verdict;
        LocatedScan { alignment: located.alignment.but(verdict, reason), ..located }
    }

    /// Where the robot may be, and which way up: within the reach of its last good pose.
    fn search_query(&self, robot: &RobotName, timestamp_ns: Option<i64>, number: u64) -> LocalizationQuery {
        let Some((recovery, (last, _))) = self.recovery.zip(self.last_good(robot)) else {
            return LocalizationQuery { candidates: CANDIDATES, ..LocalizationQuery::default() };
        };
        let (settings, search_box) = (recovery.settings, self.reachable(robot, timestamp_ns));
        let gravity = settings.keeps_tilt_in(number).then(|| down_of(&last)).flatten();
        LocalizationQuery { gravity, search_box, candidates: CANDIDATES, seed: number }
    }
}

impl ScanMapper<'_> {
    /// Where a robot can have gone since its last good pose; none where that, or its time, is not known.
    pub(super) fn reachable(&self, robot: &RobotName, timestamp_ns: Option<i64>) -> Option<SearchBox> {
        let settings = self.recovery?.settings;
        let (last, last_ns) = self.last_good(robot)?;
        let elapsed_ns = timestamp_ns?.checked_sub(last_ns?).filter(|ns| *ns > 0)?;
        let distance_m = settings.distance_min_m + settings.speed_max_m_per_s * elapsed_ns as f64 * 1e-9;
        let center = translation_m(&last);
        SearchBox::new(center.map(|c| c - distance_m), center.map(|c| c + distance_m)).ok()
    }
}

/// The direction down of a sensor at `map_from_sensor`, if the map's z axis points up.
fn down_of(map_from_sensor: &Pose) -> Option<Gravity> {
    let in_sensor = map_from_sensor.rotation.inverse() * Vector3::from(MAP_DOWN);
    Gravity::new(in_sensor.into(), MAP_DOWN).ok()
}

/// The place that a search found, if it is to be believed.
fn place_of(found: &Localization) -> Result<Pose, String> {
    match found.candidates.first() {
        Some(best) if found.verdict == Verdict::Accepted => Ok(best.map_from_sensor),
        _ => Err(format!("{}: {}", found.verdict.as_str(), found.reason)),
    }
}

/// A search under way, which ends with what is dropped, whatever happens.
struct Ending<'a> {
    lost: &'a LostRobots,
    task: &'a SearchTask,
    found: Result<Pose, String>,
}

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        self.lost.end_search(self.task, std::mem::replace(&mut self.found, Err(String::new())));
    }
}
