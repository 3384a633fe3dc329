//! Reports of the demonstration before and during the tours.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::planner::BATCH_POINTS;
use super::robot::Robot;
use mrol::console::Serving;
use mrol::console::{count, percent};
use mrol_map::map::MapSettings;
use mrol_service::MapInfo;

/// The report at the beginning.
#[derive(Serialize)]
pub(super) struct Beginning {
    #[serde(flatten)]
    serving: Serving,
    map: String,
    seed: u64,
    #[serde(skip)]
    settings: MapSettings,
    #[serde(skip)]
    robots: Vec<String>,
}

impl Beginning {
    pub(super) fn new(serving: Serving, map: &MapInfo, seed: u64, robots: &[Robot]) -> Self {
        let robot = |robot: &Robot| format!("{:<8}{} scans, {}", robot.name(), robot.scans(), robot.sensor());
        Self {
            serving,
            map: map.name.to_string(),
            seed,
            settings: map.settings,
            robots: robots.iter().map(robot).collect(),
        }
    }
}

impl Display for Beginning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Two robots build one map of a furnished floor, a planner asks about it meanwhile.\n")?;
        writeln!(f, "  daemon  HTTP http://{}, gRPC http://{}", self.serving.http, self.serving.grpc)?;
        let MapSettings { resolution_m, levels, .. } = self.settings;
        writeln!(f, "  map     {:?}, {levels} levels from {resolution_m} m", self.map)?;
        writeln!(f, "  scene   14 x 9 x 2.7 m, four rooms and a corridor, seed {}", self.seed)?;
        self.robots.iter().try_for_each(|robot| writeln!(f, "  {robot}"))?;
        writeln!(
            f,
            "  planner batches of {} points anywhere on the floor, one stream\n",
            count(BATCH_POINTS)
        )?;
        writeln!(
            f,
            "A robot is told where it starts, and nothing after that: each scan is aligned to the map"
        )?;
        writeln!(f, "from the robot's last pose in it. Errors are those against the simulation's true poses.")
    }
}

/// The line of one scan.
#[derive(Serialize)]
pub(super) struct Line {
    pub(super) seconds: f64,
    pub(super) robot: &'static str,
    pub(super) scan: usize,
    #[serde(skip)]
    pub(super) scans: usize,
    pub(super) verdict: &'static str,
    pub(super) reason: String,
    pub(super) overlap: f64,
    pub(super) error_m: f64,
    pub(super) error_deg: f64,
    pub(super) new_voxels: usize,
    pub(super) voxels: usize,
    pub(super) revision: u64,
    pub(super) planner_points_per_s: f64,
    pub(super) planner_share_occupied: f64,
}

impl Line {
    /// The line above those of the scans.
    pub(super) fn head() -> &'static str {
        "   time  robot     scan  overlap  error of the pose   new voxels  map voxels  planner is answered"
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scan = format!("{}/{}", self.scan, self.scans);
        write!(f, "{:>5.1} s  {:<7}{scan:>7}", self.seconds, self.robot)?;
        match self.scan {
            1 => write!(f, "        -    starts here    ")?,
            _ => write!(
                f,
                "  {:>7.3}  {:>6.1} mm {:>4.2} deg",
                self.overlap,
                self.error_m * 1e3,
                self.error_deg
            )?,
        }
        write!(f, "  {:>10}  {:>10}", count(self.new_voxels), count(self.voxels))?;
        let (rate, share) = (self.planner_points_per_s / 1e6, percent(self.planner_share_occupied));
        write!(f, "  {rate:>6.1} M points/s, {share:>6} occupied")?;
        if self.verdict == "accepted" {
            Ok(())
        } else {
            write!(f, "  REFUSED, {}: {}", self.verdict, self.reason)
        }
    }
}
