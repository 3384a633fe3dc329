//! `mrol-lab experiment convergence`: measures from how far off a guess an alignment finds the pose.

use std::fmt::{self, Display};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::cli::bench::workload::MapOptions;
use crate::experiment::convergence::{OFFSET_MAX_DEG, OFFSET_MAX_M, OffGuess, Trial, guesses_around};
use crate::report::{Table, folder};
use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::map_report::percent;
use mrol::console::output::Output;
use mrol::console::statistics::Statistics;
use mrol_map::align::{AlignmentSettings, Method, Verdict};
use mrol_map::geometry::{Pose, rotation_xyzw, translation_m};
use mrol_map::map::{MultiResolutionMap, RobotName};
use mrol_map::mapping::{self, Guess, MappingSettings, ScanMapper, Sightings};
use mrol_map::scan::{read_points, read_trajectory, scan_files};
use mrol_map::util::{Keyword, StopSignal};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment convergence scans/0000.ply scans/0001.ply --truth poses.txt --resolution 0.1 --out results/
  mrol-lab experiment convergence scans/0000.ply scans/0001.ply --truth poses.txt --resolution 0.1 --out results/ \\
       --trials 50 --levels 5 --json

The source scan is aligned to a map of the target scan alone, from guesses that are off in a uniform direction and about
a uniform axis, by up to 2 m and 40 degrees, both uniform. A trial converged that ends within 0.1 m and 1 degree of the
truth. Line k of the truth belongs to the k-th scan of the folder that a scan lies in. Writes guesses.csv (poses of the
source in the target's frame), convergence.csv (every trial) and convergence.md (a row for each 0.5 m and 10 degrees of
offset). 200 trials take some minutes.
crates/lab/benches/peers/icp.py takes guesses.csv and adds others to the comparison.";

const METHODS: [Method; 2] = [Method::Refined, Method::Overlap];
/// Width of the bins by which trials are counted, meters.
const BIN_M: f64 = 0.5;
const BIN_DEG: f64 = 10.0;

/// Share of alignments that find the pose, against how far off the guess is: a table for each method
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Convergence {
    /// The scan that the map is made of
    #[arg(value_name = "TARGET_SCAN")]
    target: PathBuf,
    /// The scan that is aligned to it
    #[arg(value_name = "SOURCE_SCAN")]
    source: PathBuf,
    /// True poses of the scans in their folder, a TUM file
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS")]
    resolution: f64,
    /// Where to write the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Guesses to start from
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    trials: u16,
    /// Seed of the guesses
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

impl Convergence {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let map = self.map_of_target()?;
        let source = Scan::of_finite(read_points(&self.source)?, None).points;
        let truth = self.pose_of(&self.target)?.inv_mul(&self.pose_of(&self.source)?);
        let guesses = guesses_around(&truth, self.trials.into(), self.seed);
        folder(&self.out)?;
        write_guesses(&guesses, &self.out.join("guesses.csv"))?;

        output.say(Line::HEAD)?;
        let output = output.clone().with_bar_of(METHODS.len() * guesses.len(), "alignments");
        let mut series = Vec::new();
        for method in METHODS {
            let settings = AlignmentSettings { method, ..AlignmentSettings::default() };
            let trial = |off: &OffGuess| {
                let trial = Trial::of(&map, &source, &truth, &off.guess, &settings);
                output.step();
                (*off, trial)
            };
            let trials: Vec<_> = guesses.iter().map(trial).collect();
            output.print(&Line::of(method, &trials))?;
            series.push(Series { method, trials });
        }
        output.clear_bar();
        write_trials(&series, &self.out.join("convergence.csv"))?;
        Ok(by_offset(&series).write_markdown(&self.out.join("convergence.md"))?)
    }

    fn map_of_target(&self) -> Result<MultiResolutionMap, CliError> {
        let settings = self.map.settings(self.resolution)?;
        let map = MultiResolutionMap::new(settings).map_err(CliError::usage)?;
        let robot = RobotName::new("experiment").map_err(CliError::failed)?;
        let points = Scan::of_finite(read_points(&self.target)?, None).points;
        let sightings = Sightings::default();
        let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
        let guess = Guess::Pose(Pose::identity());
        let scan = mapping::Scan { guess, at_guess: true, ..mapping::Scan::new(&robot, &points) };
        mapper.map_scan(&scan, StopSignal::NEVER).map_err(CliError::failed)?;
        Ok(map)
    }

    /// True pose of `scan`: the line of the truth whose number is that of the scan in its folder.
    fn pose_of(&self, scan: &Path) -> Result<Pose, CliError> {
        let (poses, file) = (read_trajectory(&self.truth)?, self.truth.display());
        let folder = scan.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let files = scan_files(&[folder.to_path_buf()])?;
        let k = files.iter().position(|file| file.file_name() == scan.file_name());
        let pose = k.and_then(|k| poses.get(k)).ok_or_else(|| {
            let (scan, count) = (scan.display(), poses.len());
            CliError::failed(format!(
                "{file}: {count} poses, none for {scan}: there must be a line for each scan"
            ))
        })?;
        Ok(pose.map_from_sensor)
    }
}

/// The trials of one method.
struct Series {
    method: Method,
    trials: Vec<(OffGuess, Trial)>,
}

fn write_guesses(guesses: &[OffGuess], path: &Path) -> Result<(), CliError> {
    let mut table = Table::new(["trial", "offset_m", "offset_deg", "x", "y", "z", "qx", "qy", "qz", "qw"]);
    for (trial, off) in guesses.iter().enumerate() {
        let pose = [&translation_m(&off.guess)[..], &rotation_xyzw(&off.guess)].concat();
        let numbers = [off.offset_m, off.offset_deg].into_iter().chain(pose);
        table.push(std::iter::once(trial.to_string()).chain(numbers.map(|number| number.to_string())));
    }
    Ok(table.write_csv(path)?)
}

fn write_trials(series: &[Series], path: &Path) -> Result<(), CliError> {
    let head =
        ["trial", "offset_m", "offset_deg", "method", "error_m", "error_deg", "converged", "verdict", "ms"];
    let mut table = Table::new(head);
    for Series { method, trials } in series {
        for (k, (off, trial)) in trials.iter().enumerate() {
            table.push([
                k.to_string(),
                format!("{:.3}", off.offset_m),
                format!("{:.2}", off.offset_deg),
                method.as_str().to_owned(),
                format!("{:.4}", trial.error_m),
                format!("{:.3}", trial.error_deg),
                trial.converged().to_string(),
                trial.verdict.as_str().to_owned(),
                format!("{:.2}", trial.ms),
            ]);
        }
    }
    Ok(table.write_csv(path)?)
}

/// Table of the share that converged: a row for each bin of offsets and one for all.
fn by_offset(series: &[Series]) -> Table {
    let names = series.iter().map(|series| series.method.as_str());
    let mut table = Table::new(["offset m", "offset deg", "trials"].into_iter().chain(names));
    let mut row = |meters: String, degrees: String, is_in: &dyn Fn(&OffGuess) -> bool| {
        let of = |series: &Series| -> Vec<Trial> {
            series.trials.iter().filter(|(off, _)| is_in(off)).map(|&(_, trial)| trial).collect()
        };
        let trials = series.first().map_or(0, |series| of(series).len());
        let shares = series.iter().map(|series| share_converged(&of(series)).map_or("-".into(), percent));
        table.push([meters, degrees, trials.to_string()].into_iter().chain(shares));
    };
    for (m, deg) in
        bins(OFFSET_MAX_M, BIN_M).flat_map(|m| bins(OFFSET_MAX_DEG, BIN_DEG).map(move |deg| (m, deg)))
    {
        let is_in = |off: &OffGuess| m.contains(off.offset_m) && deg.contains(off.offset_deg);
        row(m.to_string(), deg.to_string(), &is_in);
    }
    row("all".into(), "all".into(), &|_| true);
    table
}

fn share_converged(trials: &[Trial]) -> Option<f64> {
    let converged = trials.iter().filter(|trial| trial.converged()).count();
    (!trials.is_empty()).then(|| converged as f64 / trials.len() as f64)
}

/// A bin of offsets, from (inclusive) and to (exclusive).
#[derive(Debug, Clone, Copy)]
struct Bin {
    from: f64,
    to: f64,
}

fn bins(max: f64, width: f64) -> impl Iterator<Item = Bin> {
    let count = (max / width).round() as u32;
    (0..count).map(move |i| Bin { from: f64::from(i) * width, to: f64::from(i + 1) * width })
}

impl Bin {
    fn contains(&self, value: f64) -> bool {
        (self.from..self.to).contains(&value)
    }
}

impl Display for Bin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} - {}", self.from, self.to)
    }
}

/// The result of one method.
#[derive(Serialize)]
struct Line {
    method: &'static str,
    trials: usize,
    converged: f64,
    accepted: f64,
    /// Share of the trials that were accepted and did not converge.
    accepted_wrongly: f64,
    ms_median: f64,
}

impl Line {
    const HEAD: &str = "method     trials  converged  accepted  of these wrongly  median ms";

    fn of(method: Method, trials: &[(OffGuess, Trial)]) -> Self {
        let of_all = |is: &dyn Fn(&Trial) -> bool| {
            trials.iter().filter(|(_, trial)| is(trial)).count() as f64 / trials.len().max(1) as f64
        };
        let accepted = |trial: &Trial| trial.verdict == Verdict::Accepted;
        let ms = Statistics::of(trials.iter().map(|(_, trial)| trial.ms).collect());
        Self {
            method: method.as_str(),
            trials: trials.len(),
            converged: of_all(&Trial::converged),
            accepted: of_all(&accepted),
            accepted_wrongly: of_all(&|trial| accepted(trial) && !trial.converged()),
            ms_median: ms.map_or(0.0, |ms| ms.median),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { method, trials, ms_median, .. } = self;
        let [converged, accepted, wrongly] =
            [self.converged, self.accepted, self.accepted_wrongly].map(percent);
        write!(f, "{method:<10} {trials:>6} {converged:>10} {accepted:>9} {wrongly:>17} {ms_median:>10.1}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_offset_falls_in_one_bin() {
        for degrees in [0.0, 9.99, 10.0, 39.99] {
            assert_eq!(bins(OFFSET_MAX_DEG, BIN_DEG).filter(|bin| bin.contains(degrees)).count(), 1);
        }
        assert_eq!(bins(OFFSET_MAX_M, BIN_M).map(|bin| bin.to_string()).last().unwrap(), "1.5 - 2");
    }
}
