//! Checks of the demonstration's results.

use std::fmt;
use std::fmt::Display;

use super::journal::{Journal, RobotSummary};
use super::planner::Told;
use super::stray::Stray;
use mrol::console::CliError;
use mrol::console::count;
use mrol_service::MapInfo;

/// Largest median error, in voxels, over a tour of 60 scans without odometry, with a margin for the order in which the
/// two robots' scans arrive.
const MEDIAN_ERROR_MAX_VOXELS: f64 = 1.5;
const MEDIAN_ERROR_MAX_DEG: f64 = 1.0;
/// Error, in voxels, beyond which a robot is lost.
const ERROR_MAX_VOXELS: f64 = 5.0;

/// Checks with their results.
pub(super) struct Checks(Vec<(bool, String)>);

impl Checks {
    pub(super) fn of(journal: &Journal, queries: &Told, info: &MapInfo, stray: &Stray) -> Self {
        Self(vec![
            all_accepted(&journal.robots()),
            close_to_the_truth(&journal.robots(), info.settings.resolution_m),
            (
                queries.occupied > 0 && queries.occupied < queries.points,
                "the planner met occupied and free voxels".to_owned(),
            ),
            same_voxels(info.levels.first().map_or(0, |finest| finest.voxels), journal.voxels()),
            (stray.is_refused(), stray.to_string()),
        ])
    }

    /// Descriptions of the failed checks.
    pub(super) fn problems(&self) -> Vec<&str> {
        self.0.iter().filter(|(good, _)| !good).map(|(_, text)| text.as_str()).collect()
    }

    /// An error where a check failed.
    pub(super) fn verdict(&self) -> Result<(), CliError> {
        match self.problems().as_slice() {
            [] => Ok(()),
            problems => Err(CliError::failed(problems.join("; "))),
        }
    }
}

fn all_accepted(robots: &[RobotSummary]) -> (bool, String) {
    let refused: usize = robots.iter().map(|robot| robot.refused).sum();
    let accepted: usize = robots.iter().map(|robot| robot.accepted).sum();
    (refused == 0 && accepted > 0, format!("{accepted} scans accepted, {refused} refused"))
}

fn close_to_the_truth(robots: &[RobotSummary], resolution_m: f64) -> (bool, String) {
    let worst = |error: fn(&RobotSummary) -> f64| robots.iter().map(error).fold(0.0, f64::max);
    let (median_m, median_deg) = (worst(|robot| robot.meters.median), worst(|robot| robot.degrees.median));
    let max_m = worst(|robot| robot.meters.max);
    let (median_max_m, max_max_m) = (MEDIAN_ERROR_MAX_VOXELS * resolution_m, ERROR_MAX_VOXELS * resolution_m);
    let good = median_m < median_max_m && median_deg < MEDIAN_ERROR_MAX_DEG && max_m < max_max_m;
    let text = format!(
        "median error {:.1} mm {median_deg:.2} deg, largest {:.1} mm; bounds {:.1} mm {MEDIAN_ERROR_MAX_DEG:.2} deg, {:.1} mm",
        median_m * 1e3,
        max_m * 1e3,
        median_max_m * 1e3,
        max_max_m * 1e3
    );
    (good, text)
}

fn same_voxels(held: usize, told: usize) -> (bool, String) {
    (held == told, format!("the map holds {} voxels, the answers spoke of {}", count(held), count(told)))
}

impl Display for Checks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines =
            self.0.iter().map(|(good, text)| format!("{}  {text}", if *good { "ok  " } else { "FAIL" }));
        write!(f, "{}", lines.next().unwrap_or_default())?;
        lines.try_for_each(|line| write!(f, "\n{line}"))
    }
}
