//! Report of the demonstration at its end.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;
use serde_json::{Value, json};

use super::checks::Checks;
use super::journal::{Journal, RobotSummary};
use super::planner::Told;
use mrol::console::{bytes, count, percent};
use mrol_service::MapInfo;

/// The summary.
pub(super) struct Summary<'a> {
    robots: Vec<RobotSummary>,
    queries: &'a Told,
    info: &'a MapInfo,
    checks: &'a Checks,
}

impl<'a> Summary<'a> {
    pub(super) fn new(journal: &Journal, queries: &'a Told, info: &'a MapInfo, checks: &'a Checks) -> Self {
        Self { robots: journal.robots(), queries, info, checks }
    }
}

impl Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nrobot   accepted  refused  error: median             largest")?;
        self.robots.iter().try_for_each(|robot| writeln!(f, "{robot}"))?;
        let Told { points, time, .. } = self.queries;
        writeln!(
            f,
            "\nplanner  {} points answered in {:.1} s beside the mapping: {:.1} M points/s, {} occupied",
            count(*points as usize),
            time.as_secs_f64(),
            self.queries.points_per_s() / 1e6,
            percent(self.queries.share_occupied())
        )?;
        if let Some(finest) = self.info.levels.first() {
            let filter = finest.filter.unwrap_or_default();
            writeln!(
                f,
                "map      {} voxels of {} m in {}, filter plane {}; it lets {} of absent neighbors through",
                count(finest.voxels),
                finest.resolution_m,
                bytes(self.info.set_bytes),
                bytes(filter.plane_bytes),
                filter.measured_rate.map_or("none".into(), percent)
            )?;
        }
        write!(f, "\n{}", self.checks)
    }
}

impl Display for RobotSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, accepted, refused, meters: m, degrees: d } = self;
        write!(f, "{name:<8}{accepted:>8} {refused:>8}  ")?;
        write!(f, "{:>6.1} mm {:>5.2} deg  ", m.median * 1e3, d.median)?;
        write!(f, "{:>6.1} mm {:>5.2} deg", m.max * 1e3, d.max)
    }
}

impl Serialize for Summary<'_> {
    /// As `{"summary": {...}}`, to be told from a scan.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let robot = |robot: &RobotSummary| {
            let summary = json!({
                "accepted": robot.accepted, "refused": robot.refused,
                "error_m": robot.meters, "error_deg": robot.degrees,
            });
            (robot.name.to_owned(), summary)
        };
        let robots: serde_json::Map<String, Value> = self.robots.iter().map(robot).collect();
        let planner = json!({
            "points": self.queries.points,
            "points_per_s": self.queries.points_per_s(),
            "share_occupied": self.queries.share_occupied(),
        });
        let voxels = self.info.levels.first().map(|finest| finest.voxels);
        let summary = json!({
            "robots": robots, "planner": planner, "voxels": voxels,
            "revision": self.info.version.revision, "problems": self.checks.problems(),
        });
        json!({ "summary": summary }).serialize(serializer)
    }
}
