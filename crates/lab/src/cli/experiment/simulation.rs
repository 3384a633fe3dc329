//! `mrol-lab experiment simulation`: compares poses with the filter and without, on a simulated sequence (paper IV-B).

use mrol_map::util::Keyword;
use std::fmt::{self, Display};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use crate::report::chart::{Axis, Curve, Panel, Scale, Style, panels};
use crate::report::{Table, folder};
use crate::workload::{self, Scan};
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol::offline::{ErrorSummary, TruthErrors};
use mrol::offline::{FalsePositives, FilterSummary};
use mrol::offline::{Mapped, Mapper};
use mrol_map::align::{AlignmentSettings, Method, MultiStartSettings};
use mrol_map::bloom::FilterSettings;
use mrol_map::geometry::{Pose, pose_difference};
use mrol_map::map::{Lookup, MapSettings};
use mrol_map::mapping::Guess;
use mrol_simulate::{Sensor, Tour, tours};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment simulation --out results/
  mrol-lab experiment simulation --out results/ --noise 0.0015 --judged
  mrol-lab experiment simulation --out results/ --scans 200 --small-filter-bits-per-key 4 --json

\"With a Bloom filter size of 6 x 10^6 the pose solutions obtained were identical however at 6 x 10^5 a position error of
around 0.02m was introduced\" (IV-B). A depth camera goes through a furnished building; each scan is aligned from the
last pose, by overlap (the paper's method) and refined, with look-ups answered by the exact set, by the default filter,
by one that is ample (below one false positive is expected in the whole run) and by one that is too small. Every scan
goes into the map, as in the paper, whatever the verdict on it; with --judged only those that fit, and the robot is looked
for where one does not. Errors are those of inv(E_0) E_k against inv(T_0) T_k. Writes simulation.svg, simulation.csv (every scan) and simulation.md.";

const METHODS: [Method; 2] = [Method::Overlap, Method::Refined];

/// Experiment 2 of the paper: simulated scans with perfect truth, with the filter, without, and with a small one
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Simulation {
    /// Where to write the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Scans of the sequence
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(2..=2000))]
    scans: u16,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.04)]
    resolution: f64,
    /// Number of levels
    #[arg(long, default_value_t = 4)]
    levels: u32,
    /// Bits of the planes a voxel of the filter that is too small: 1 to 4096
    #[arg(long, value_name = "BITS", default_value_t = 1.5)]
    small_filter_bits_per_key: f64,
    /// Which simulated robot's tour
    #[arg(long, value_enum, default_value_t)]
    robot: RobotKind,
    /// Noise of the depth at one meter, meters, which grows with the depth squared; of the lidar, at any range. None in
    /// the paper
    #[arg(long, value_name = "METERS", default_value_t = 0.0)]
    noise: f64,
    /// Leave refused scans out, and look for the robot then, as `mrol map` does; errors are those of accepted scans
    #[arg(long)]
    judged: bool,
    /// Seed of furniture and noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// The robot whose tour is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum RobotKind {
    #[default]
    Camera,
    Lidar,
}

/// A way to answer look-ups.
#[derive(Debug, Clone, Copy)]
struct Answers {
    name: &'static str,
    lookup: Lookup,
    filter: FilterSettings,
}

impl Simulation {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        folder(&self.out)?;
        let scans = workload::simulate(&self.tour(), self.seed);
        output.say(Line::HEAD)?;
        let answers = self.answers();
        let bar = output.clone().with_bar(scans.len() * (METHODS.len() * answers.len() + 1));
        let mut runs = Vec::new();
        for method in METHODS {
            let mut exact = None;
            for answers in answers {
                let run = self.map(&scans, method, answers, &bar)?;
                let exact = exact.get_or_insert_with(|| run.poses());
                bar.print(&Line::of(&run, exact))?;
                runs.push((run, exact.clone()));
            }
        }
        let at_truth = self.map_at_truth(&scans, &bar)?;
        bar.clear_bar();
        write_scans(&runs, &self.out.join("simulation.csv"))?;
        write_runs(&runs, &self.out.join("simulation.md"))?;
        let runs: Vec<_> = runs.into_iter().map(|(run, _)| run).collect();
        Ok(panels(&self.out.join("simulation.svg"), &[self.errors(&runs), self.growth(&runs, at_truth)])?)
    }

    fn tour(&self) -> Tour {
        let [lidar, camera] = tours(self.scans.into());
        let mut tour = match self.robot {
            RobotKind::Camera => camera,
            RobotKind::Lidar => lidar,
        };
        match &mut tour.sensor {
            Sensor::DepthCamera(camera) => camera.noise_at_1m_m = self.noise,
            Sensor::SpinningLidar(lidar) => lidar.noise_m = self.noise,
        }
        tour
    }

    /// The ways to answer look-ups. The exact set is first, since the others are compared with it; the ample filter is
    /// last, so that its curve is drawn on top.
    fn answers(&self) -> [Answers; 4] {
        let filter = FilterSettings::default();
        let small = FilterSettings { bits_per_key: self.small_filter_bits_per_key, ..filter };
        let ample = FilterSettings { hashes: 10, bits_per_key: 2048.0 };
        [
            Answers { name: "exact set", lookup: Lookup::Exact, filter },
            Answers { name: "default filter", lookup: Lookup::Bloom, filter },
            Answers { name: "small filter", lookup: Lookup::Bloom, filter: small },
            Answers { name: "ample filter", lookup: Lookup::Bloom, filter: ample },
        ]
    }

    fn map(&self, scans: &[Scan], method: Method, answers: Answers, bar: &Output) -> Result<Run, CliError> {
        let mut mapper = self.mapper(answers.filter, self.alignment(method, answers.lookup))?;
        let mut errors = TruthErrors::new(truth(scans));
        let mut false_positives = FalsePositives::default();
        let mut mapped_scans = Vec::new();
        for (k, scan) in scans.iter().enumerate() {
            let mapped = mapper.add(k, &scan.points, None).map_err(CliError::failed)?;
            false_positives.add(mapped.alignment.lookups, mapped.false_positive_rate);
            let counts = !self.judged || mapped.accepted();
            let error = counts.then(|| errors.add(k, &mapped.alignment.map_from_sensor));
            mapped_scans.push((mapped, error));
            bar.step();
        }
        let filter = false_positives.summary(mapper.false_positive_rate());
        Ok(Run { method, answers, scans: mapped_scans, filter, error: errors.summary() })
    }

    /// Number of voxels after each scan, with the scans at their true poses.
    fn map_at_truth(&self, scans: &[Scan], bar: &Output) -> Result<Vec<f64>, CliError> {
        let mut mapper = self.mapper(FilterSettings::default(), AlignmentSettings::default())?;
        let truth = truth(scans);
        let add = |(k, scan): (usize, &Scan)| {
            bar.step();
            // In the frame of the first scan, like the other maps.
            let mapped = mapper.add(k, &scan.points, Some(truth[0].inv_mul(&truth[k])));
            Ok(mapped.map_err(CliError::failed)?.voxels as f64)
        };
        scans.iter().enumerate().map(add).collect()
    }

    fn mapper(&self, filter: FilterSettings, settings: AlignmentSettings) -> Result<Mapper, CliError> {
        let map = MapSettings { filter: Some(filter), ..MapSettings::new(self.resolution, self.levels) };
        Ok(Mapper::new(map, settings, Guess::Last)?.recovering(self.judged))
    }

    fn alignment(&self, method: Method, lookup: Lookup) -> AlignmentSettings {
        match self.judged {
            true => AlignmentSettings { method, lookup, ..AlignmentSettings::default() },
            false => unjudged(method, lookup),
        }
    }

    fn errors(&self, runs: &[Run]) -> Panel {
        // The default filter's curves are those of the ample one, nearly.
        let shown = runs.iter().filter(|run| run.answers.name != "default filter");
        let curve = |run: &Run| {
            let of_scan = |(k, (_, error)): (usize, &(Mapped, ScanError))| Some((k, error.as_ref()?.0 * 1e3));
            let errors = run.scans.iter().enumerate().filter_map(of_scan);
            // The first scan's error is zero by definition, which a logarithm cannot show.
            run.curve(errors.skip(1).filter(|(_, error)| *error > 0.0))
        };
        Panel {
            title: format!("Error of position, voxels of {} mm", self.resolution * 1e3),
            x: Axis { name: "scan", scale: Scale::Linear },
            y: Axis { name: "mm", scale: Scale::Logarithmic },
            curves: shown.map(curve).collect(),
        }
    }

    fn growth(&self, runs: &[Run], at_truth: Vec<f64>) -> Panel {
        let shown = runs.iter().filter(|run| run.answers.name != "default filter");
        let mut curves: Vec<_> = shown
            .map(|run| run.curve(run.scans.iter().map(|(mapped, _)| mapped.voxels as f64).enumerate()))
            .collect();
        curves.push(Curve {
            name: "at the true poses".into(),
            color: 5,
            style: Style::Solid,
            points: numbered(at_truth.into_iter().enumerate()),
        });
        Panel {
            title: "Growth of the map".into(),
            x: Axis { name: "scan", scale: Scale::Linear },
            y: Axis { name: "occupied voxels", scale: Scale::Linear },
            curves,
        }
    }
}

/// Alignment settings that accept every scan, as the paper does, which has no verdict: a refused scan would look like
/// an error of the filter.
fn unjudged(method: Method, lookup: Lookup) -> AlignmentSettings {
    let defaults = AlignmentSettings::default();
    AlignmentSettings {
        method,
        lookup,
        overlap_min: 0.0,
        undetermined_std: f64::MAX,
        multi_start: MultiStartSettings {
            fitness_below: 0.0,
            correction_above: f64::MAX,
            std_above: f64::MAX,
            motion_above: f64::MAX,
            motion_above_deg: f64::MAX,
            ..defaults.multi_start
        },
        ..defaults
    }
}

fn truth(scans: &[Scan]) -> Vec<Pose> {
    scans.iter().filter_map(|scan| scan.map_from_sensor).collect()
}

fn numbered(values: impl Iterator<Item = (usize, f64)>) -> Vec<(f64, f64)> {
    values.map(|(k, value)| (k as f64, value)).collect()
}

/// Error of a scan's pose, meters and degrees; none of one that was refused and left out.
type ScanError = Option<(f64, f64)>;

/// A map of all scans.
struct Run {
    method: Method,
    answers: Answers,
    scans: Vec<(Mapped, ScanError)>,
    filter: FilterSummary,
    error: Option<ErrorSummary>,
}

impl Run {
    fn poses(&self) -> Vec<Pose> {
        self.scans.iter().map(|(mapped, _)| mapped.alignment.map_from_sensor).collect()
    }

    fn curve(&self, values: impl Iterator<Item = (usize, f64)>) -> Curve {
        let refined = usize::from(self.method == Method::Refined);
        let (color, style) = match self.answers.name {
            "small filter" => (2 + refined, Style::Solid),
            // Drawn on top of those of the exact set, which a solid curve would hide.
            "ample filter" => (4, Style::Dashed),
            _ => (refined, Style::Solid),
        };
        let name = format!("{}, {}", self.method.as_str(), self.answers.name);
        Curve { name, color, style, points: numbered(values) }
    }
}

fn write_scans(runs: &[(Run, Vec<Pose>)], path: &Path) -> Result<(), CliError> {
    let head = ["scan", "method", "answers", "error_m", "error_deg", "voxels", "align_ms"];
    let mut table = Table::new(head);
    for (run, _) in runs {
        for (k, (mapped, error)) in run.scans.iter().enumerate() {
            let [meters, degrees] = match error {
                Some((meters, degrees)) => [format!("{meters:.6}"), format!("{degrees:.5}")],
                None => [String::new(), String::new()],
            };
            table.push([
                k.to_string(),
                run.method.as_str().to_owned(),
                run.answers.name.to_owned(),
                meters,
                degrees,
                mapped.voxels.to_string(),
                format!("{:.2}", mapped.align_time.as_secs_f64() * 1e3),
            ]);
        }
    }
    Ok(table.write_csv(path)?)
}

fn write_runs(runs: &[(Run, Vec<Pose>)], path: &Path) -> Result<(), CliError> {
    let mut table = Table::new([
        "method",
        "look-ups",
        "bits a voxel",
        "false positives",
        "median error",
        "largest error",
        "voxels",
        "furthest from the exact set's poses",
    ]);
    for (run, exact) in runs {
        let line = Line::of(run, exact);
        let rate = line.false_positive_rate.map_or("none".to_owned(), |rate| format!("{rate:.1e}"));
        table.push([
            line.method.to_owned(),
            line.answers.to_owned(),
            line.filter_bits_per_key.map_or("-".to_owned(), |bits| bits.to_string()),
            rate,
            millimeters(line.error_m_median, line.error_deg_median),
            millimeters(line.error_m_max, line.error_deg_max),
            count(line.voxels),
            line.distance(),
        ]);
    }
    Ok(table.write_markdown(path)?)
}

/// The result of one map.
#[derive(Serialize)]
struct Line {
    method: &'static str,
    answers: &'static str,
    filter_hashes: Option<u32>,
    filter_bits_per_key: Option<f64>,
    false_positive_rate: Option<f64>,
    /// Upper bound of the expected false positives in all look-ups of the run.
    expected_false_positives: Option<f64>,
    scans: usize,
    /// Scans that fit from the pose that they were looked for at, or anywhere that their robot was looked for.
    accepted: usize,
    /// Those among them by which the robot was found again.
    recovered: usize,
    error_m_median: f64,
    error_deg_median: f64,
    error_m_max: f64,
    error_deg_max: f64,
    voxels: usize,
    /// True when every pose equals that of the exact set, bit for bit.
    poses_are_the_exact_sets: bool,
    furthest_from_exact_m: f64,
    furthest_from_exact_deg: f64,
}

impl Line {
    const HEAD: &str = "method    look-ups        bits a voxel  false pos.  scans  accepted  recovered  median error         \
                        largest error        voxels    from the exact set's poses";

    fn of(run: &Run, exact: &[Pose]) -> Self {
        let poses = run.poses();
        let differences: Vec<_> = poses.iter().zip(exact).map(|(a, b)| pose_difference(a, b)).collect();
        let furthest = |of: fn(&(f64, f64)) -> f64| differences.iter().map(of).fold(0.0, f64::max);
        let filter = (run.answers.lookup == Lookup::Bloom).then_some(run.answers.filter);
        let of_errors = |of: fn(&ErrorSummary) -> f64| run.error.as_ref().map_or(0.0, of);
        Self {
            method: run.method.as_str(),
            answers: run.answers.name,
            filter_hashes: filter.map(|filter| filter.hashes),
            filter_bits_per_key: filter.map(|filter| filter.bits_per_key),
            false_positive_rate: filter.map(|_| run.filter.expected_false_positive_rate),
            expected_false_positives: filter.map(|_| run.filter.expected_false_positives),
            scans: run.scans.len(),
            accepted: run.scans.iter().filter(|(mapped, _)| mapped.accepted()).count(),
            recovered: run.scans.iter().filter(|(mapped, _)| mapped.recovered.is_some()).count(),
            error_m_median: of_errors(|error| error.meters.median),
            error_deg_median: of_errors(|error| error.degrees.median),
            error_m_max: of_errors(|error| error.meters.max),
            error_deg_max: of_errors(|error| error.degrees.max),
            voxels: run.scans.last().map_or(0, |(mapped, _)| mapped.voxels),
            poses_are_the_exact_sets: poses == exact,
            furthest_from_exact_m: furthest(|difference| difference.0),
            furthest_from_exact_deg: furthest(|difference| difference.1),
        }
    }

    fn distance(&self) -> String {
        match self.poses_are_the_exact_sets {
            true => "identical".to_owned(),
            false => millimeters(self.furthest_from_exact_m, self.furthest_from_exact_deg),
        }
    }
}

fn millimeters(meters: f64, degrees: f64) -> String {
    format!("{:.2} mm {degrees:.3} deg", meters * 1e3)
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { method, answers, scans, accepted, recovered, .. } = self;
        let bits = self.filter_bits_per_key.map_or("-".to_owned(), |bits| bits.to_string());
        let rate = self.false_positive_rate.map_or("none".to_owned(), |rate| format!("{rate:.1e}"));
        let median = millimeters(self.error_m_median, self.error_deg_median);
        let max = millimeters(self.error_m_max, self.error_deg_max);
        let (voxels, distance) = (count(self.voxels), self.distance());
        write!(
            f,
            "{method:<9} {answers:<15} {bits:>12}  {rate:>10}  {scans:>5}  {accepted:>8}  {recovered:>9}  {median:<20} {max:<20} {voxels:>7}  {distance}"
        )
    }
}
