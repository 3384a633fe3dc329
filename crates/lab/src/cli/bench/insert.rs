//! `mrol-lab bench insert`: times insertion and removal.

use std::fmt::{self, Display};

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions, times};
use crate::measure::insert::{into_hash_set, into_map, out_of_map};
use crate::measure::stopwatch::Runs;
use crate::workload::{Order, Queries};
use mrol::console::error::CliError;
use mrol::console::map_report::{bytes, count};
use mrol::console::output::Output;
use mrol_map::map::MapSettings;
use mrol_map::voxel::Lattice;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench insert --workload site                 scans of a robot that drives through the site
  mrol-lab bench insert --workload site --order sweep   the site row by row
  mrol-lab bench insert --workload room --queries 100000 --json

Points go in at a known pose, scan by scan, on one core, without a journal: into an empty map (all new), again (all
known), and out again (removed). Each point has a voxel of its own: of the workload's points, the first in each. The
map does all its levels and filters, the hash set one level without a filter; its keys are not taken out. Figures are
medians of --repeats runs.";

/// Number of points that are generated for each that is inserted: a sensor sees most voxels more than once.
const POINTS_PER_VOXEL: usize = 6;

/// Time insertion and removal: new points, known ones, and what a hash set takes for them
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Insert {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Points of a scan
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..))]
    scan_points: u32,
    /// Runs, each with a new map
    #[arg(long, value_name = "N", default_value = "5", value_parser = times)]
    repeats: usize,
}

impl Insert {
    pub(super) fn run(mut self, output: &Output) -> Result<(), CliError> {
        self.workload = self.workload.usually(Order::Scan);
        let settings = self.map.settings(self.workload.workload().resolution_m())?;
        let points = self.points(&settings)?;
        if points.points.is_empty() {
            return Err(CliError::failed("the workload shows no point: make it larger"));
        }
        output.say(format!(
            "{}: {} points, each in a voxel of its own, {} a scan, {} levels, median of {} runs",
            self.workload,
            count(points.points.len()),
            count(self.scan_points as usize),
            settings.levels,
            self.repeats
        ))?;
        output.say(Line::HEAD)?;
        self.print(&points, settings, output)
    }

    fn points(&self, settings: &MapSettings) -> Result<Queries, CliError> {
        let lattice = Lattice::new(settings.resolution_m, 1).map_err(CliError::usage)?;
        let all = self.workload.queries(POINTS_PER_VOXEL);
        Ok(all.first_of_each_voxel(|pose| lattice.from_points(pose), self.workload.points()))
    }

    fn print(&self, points: &Queries, settings: MapSettings, output: &Output) -> Result<(), CliError> {
        let (scan, repeats) = (self.scan_points as usize, self.repeats);
        let map = into_map(settings, points, scan, repeats).map_err(CliError::usage)?;
        let set = into_hash_set(settings, points, scan, repeats).map_err(CliError::usage)?;
        let removed = out_of_map(settings, points, scan, repeats).map_err(CliError::usage)?;
        let n = points.points.len();
        let lines = [
            Line::of("map", "new", &map.new, n, map.bytes),
            Line::of("map", "known", &map.known, n, map.bytes),
            Line::of("map", "removed", &removed, n, map.bytes),
            Line::of("hashset", "new", &set.new, n, set.bytes),
            Line::of("hashset", "known", &set.known, n, set.bytes),
        ];
        lines.iter().try_for_each(|line| output.print(line))
    }
}

/// The result of one structure and one kind of points.
#[derive(Serialize)]
struct Line {
    structure: &'static str,
    points_are: &'static str,
    ns_per_point: f64,
    points_per_s: f64,
    points: usize,
    /// Bytes of the structure when it holds all points.
    bytes: usize,
    bytes_per_voxel: f64,
}

impl Line {
    const HEAD: &str = "structure  points are  ns a point  M points/s         bytes  bytes a voxel";

    fn of(
        structure: &'static str,
        points_are: &'static str,
        runs: &Runs,
        points: usize,
        bytes: usize,
    ) -> Self {
        let ns_per_point = runs.median();
        Self {
            structure,
            points_are,
            ns_per_point,
            points_per_s: 1e9 / ns_per_point,
            points,
            bytes,
            bytes_per_voxel: bytes as f64 / points as f64,
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<10} {:<11} {:>10.1} {:>11.2} {:>13} {:>14.1}",
            self.structure,
            self.points_are,
            self.ns_per_point,
            self.points_per_s / 1e6,
            bytes(self.bytes),
            self.bytes_per_voxel
        )
    }
}
