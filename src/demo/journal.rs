//! Record of what happened to the robots' scans.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::planner::{Tally, Told};
use super::report::Line;
use super::robot::News;
use mrol::console::Statistics;

/// Least time over which the planner's rate is computed, since lines may come at once.
const RATE_WINDOW: Duration = Duration::from_millis(100);

/// All answers to the robots, and how the map grew.
pub(super) struct Journal {
    start: Instant,
    tally: Arc<Tally>,
    /// Time and tally at the beginning of the present window, and the rate of the window before.
    window: (Instant, u64, u64),
    told: Option<Told>,
    robots: Vec<RobotJournal>,
    voxels: usize,
}

/// The journal of one robot.
#[derive(Default)]
pub(super) struct RobotJournal {
    name: &'static str,
    accepted: usize,
    refused: usize,
    meters: Vec<f64>,
    degrees: Vec<f64>,
}

/// Summary of a robot's journal.
pub(super) struct RobotSummary {
    pub(super) name: &'static str,
    pub(super) accepted: usize,
    pub(super) refused: usize,
    pub(super) meters: Statistics,
    pub(super) degrees: Statistics,
}

impl Journal {
    pub(super) fn new(start: Instant, tally: Arc<Tally>) -> Self {
        Self { start, tally, window: (start, 0, 0), told: None, robots: Vec::new(), voxels: 0 }
    }

    /// Records a scan; returns its line.
    pub(super) fn enter(&mut self, news: News) -> Line {
        let answer = &news.answer;
        self.voxels += answer.new_voxels;
        self.robot(news.robot).enter(answer.accepted, news.error);
        let told = self.told_lately();
        Line {
            seconds: self.start.elapsed().as_secs_f64(),
            robot: news.robot,
            scan: news.scan,
            scans: news.scans,
            verdict: answer.verdict.as_str(),
            reason: answer.reason.clone(),
            overlap: answer.overlap(),
            error_m: news.error.0,
            error_deg: news.error.1,
            new_voxels: answer.new_voxels,
            voxels: self.voxels,
            revision: answer.version.revision,
            planner_points_per_s: told.points_per_s(),
            planner_share_occupied: told.share_occupied(),
        }
    }

    fn robot(&mut self, name: &'static str) -> &mut RobotJournal {
        let place = self.robots.iter().position(|robot| robot.name == name).unwrap_or_else(|| {
            self.robots.push(RobotJournal { name, ..RobotJournal::default() });
            self.robots.len() - 1
        });
        &mut self.robots[place]
    }

    /// The planner's rate in the last window that is long enough.
    fn told_lately(&mut self) -> Told {
        let (then, points_then, occupied_then) = self.window;
        let (now, (points, occupied)) = (Instant::now(), self.tally.read());
        let told =
            Told { points: points - points_then, occupied: occupied - occupied_then, time: now - then };
        if told.time < RATE_WINDOW {
            return self.told.unwrap_or(told);
        }
        self.window = (now, points, occupied);
        *self.told.insert(told)
    }

    /// Number of voxels by the answers.
    pub(super) fn voxels(&self) -> usize {
        self.voxels
    }

    /// Summaries of the robots, sorted by name.
    pub(super) fn robots(&self) -> Vec<RobotSummary> {
        let mut robots: Vec<_> = self.robots.iter().filter_map(RobotJournal::summary).collect();
        robots.sort_unstable_by_key(|robot| robot.name);
        robots
    }
}

impl RobotJournal {
    fn enter(&mut self, accepted: bool, (meters, degrees): (f64, f64)) {
        if !accepted {
            self.refused += 1;
            return;
        }
        self.accepted += 1;
        // The first scan is placed, not aligned.
        if self.accepted > 1 {
            self.meters.push(meters);
            self.degrees.push(degrees);
        }
    }

    fn summary(&self) -> Option<RobotSummary> {
        Some(RobotSummary {
            name: self.name,
            accepted: self.accepted,
            refused: self.refused,
            meters: Statistics::of(self.meters.clone())?,
            degrees: Statistics::of(self.degrees.clone())?,
        })
    }
}
