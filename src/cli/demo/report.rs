//! What the demonstration prints.

use std::fmt::{self, Display};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::{Value, json};

use super::checks::Checks;
use super::planner::{BATCH_POINTS, Tally, Told};
use super::robot::{News, Robot};
use crate::cli::map_report::{bytes, count, percent};
use crate::cli::serve::Serving;
use crate::cli::statistics::Statistics;
use crate::map::MapSettings;
use crate::service::MapInfo;

/// Over which the planner's rate is told: lines may come at once.
const RATE_WINDOW: Duration = Duration::from_millis(250);

/// What is about to happen.
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

/// Of one scan.
#[derive(Serialize)]
pub(super) struct Line {
    seconds: f64,
    robot: &'static str,
    scan: usize,
    #[serde(skip)]
    scans: usize,
    verdict: &'static str,
    overlap: f64,
    error_m: f64,
    error_deg: f64,
    new_voxels: usize,
    voxels: usize,
    revision: u64,
    planner_points_per_s: f64,
    planner_share_occupied: f64,
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
        if self.verdict == "accepted" { Ok(()) } else { write!(f, "  REFUSED: {}", self.verdict) }
    }
}

/// All that the robots were told, and how the map grew.
pub(super) struct Journal {
    start: Instant,
    tally: Arc<Tally>,
    /// The tally at the beginning of the window whose rate is told, and the rate of the window before.
    window: (Instant, u64, u64),
    told: Option<Told>,
    robots: Vec<RobotJournal>,
    voxels: usize,
}

/// Of one robot.
#[derive(Default)]
pub(super) struct RobotJournal {
    name: &'static str,
    accepted: usize,
    refused: usize,
    metres: Vec<f64>,
    degrees: Vec<f64>,
}

/// What a robot's journal comes to.
pub(super) struct RobotSummary {
    pub(super) name: &'static str,
    pub(super) accepted: usize,
    pub(super) refused: usize,
    pub(super) metres: Statistics,
    pub(super) degrees: Statistics,
}

impl Journal {
    pub(super) fn new(start: Instant, tally: Arc<Tally>) -> Self {
        Self { start, tally, window: (start, 0, 0), told: None, robots: Vec::new(), voxels: 0 }
    }

    /// The line above those of the scans.
    pub(super) fn head() -> &'static str {
        "   time  robot     scan  overlap  error of the pose   new voxels  map voxels  planner is answered"
    }

    /// Enters a scan; its line.
    pub(super) fn enter(&mut self, news: News) -> Line {
        let answer = &news.answer;
        self.voxels += answer.new_voxels;
        self.robot(news.robot).enter(answer.accepted(), news.error);
        let told = self.told_lately();
        Line {
            seconds: self.start.elapsed().as_secs_f64(),
            robot: news.robot,
            scan: news.scan,
            scans: news.scans,
            verdict: answer.verdict.as_str(),
            overlap: answer.overlap(),
            error_m: news.error.0,
            error_deg: news.error.1,
            new_voxels: answer.new_voxels,
            voxels: self.voxels,
            revision: answer.state.revision,
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

    /// What the planner was told in the last window that is long enough for a rate.
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

    /// Voxels that the answers speak of.
    pub(super) fn voxels(&self) -> usize {
        self.voxels
    }

    /// By name.
    pub(super) fn robots(&self) -> Vec<RobotSummary> {
        let mut robots: Vec<_> = self.robots.iter().filter_map(RobotJournal::summary).collect();
        robots.sort_unstable_by_key(|robot| robot.name);
        robots
    }

    pub(super) fn summary<'a>(
        &self,
        queries: &'a Told,
        info: &'a MapInfo,
        checks: &'a Checks,
    ) -> Summary<'a> {
        Summary { robots: self.robots(), queries, info, checks }
    }
}

impl RobotJournal {
    fn enter(&mut self, accepted: bool, (metres, degrees): (f64, f64)) {
        if !accepted {
            self.refused += 1;
            return;
        }
        self.accepted += 1;
        // The first scan is where it was told to be.
        if self.accepted > 1 {
            self.metres.push(metres);
            self.degrees.push(degrees);
        }
    }

    fn summary(&self) -> Option<RobotSummary> {
        Some(RobotSummary {
            name: self.name,
            accepted: self.accepted,
            refused: self.refused,
            metres: Statistics::of(self.metres.clone())?,
            degrees: Statistics::of(self.degrees.clone())?,
        })
    }
}

/// What it all comes to.
pub(super) struct Summary<'a> {
    robots: Vec<RobotSummary>,
    queries: &'a Told,
    info: &'a MapInfo,
    checks: &'a Checks,
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
            writeln!(
                f,
                "map      {} voxels of {} m in {}, filter plane {}; it lets {} of absent neighbours through",
                count(finest.voxels),
                finest.resolution_m,
                bytes(self.info.set_bytes),
                bytes(finest.plane_bytes),
                finest.measured_rate.map_or("none".into(), percent)
            )?;
        }
        write!(f, "\n{}", self.checks)
    }
}

impl Display for RobotSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, accepted, refused, metres: m, degrees: d } = self;
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
                "error_m": robot.metres, "error_deg": robot.degrees,
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
            "revision": self.info.state.revision, "problems": self.checks.problems(),
        });
        json!({ "summary": summary }).serialize(serializer)
    }
}
