//! `mrol-lab bench nearest`: times searches for the nearest voxel.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions, size_of, times};
use crate::measure::nearest::{Searched, search};
use crate::measure::peer_file;
use mrol::console::error::CliError;
use mrol::console::map_report::{count, percent};
use mrol::console::output::Output;
use mrol::console::parse;
use mrol_map::planning::{MeasuredTo, NearestRequest};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench nearest --queries 100000 --to centers
  mrol-lab bench nearest --workload site --queries 100000 --to centers --peer-file points.bin
  cargo run --release --manifest-path crates/lab/benches/peers/kiddo/Cargo.toml -- points.bin

One core, through the map's locks, from points to distances, voxels and directions; ns_per_point is the median of
--repeats passes after one that is not timed. --peer-file writes voxels, points and distances for other libraries.";

/// Time searches: how far each point is from the nearest voxel, and which way leads away from it
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Nearest {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// How far to look, meters
    #[arg(long, value_name = "METERS", default_value_t = 1.0)]
    radius: f64,
    /// What distances are measured to
    #[arg(long, value_parser = parse::keyword::<MeasuredTo>(), default_value = "cubes")]
    to: MeasuredTo,
    /// Level to ask: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// Passes over all points
    #[arg(long, value_name = "N", default_value = "11", value_parser = times)]
    repeats: usize,
    /// Write voxels, points and distances to this file
    #[arg(long, value_name = "FILE")]
    peer_file: Option<PathBuf>,
}

impl Nearest {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let map = self.map.map_of(self.workload.workload())?;
        self.map.check_level(self.level)?;
        let points = self.workload.map_points();
        let (size, passes) = (size_of(&map, self.level), self.repeats);
        output.say(format!(
            "{}: {size}, {} points, median of {passes} passes",
            self.workload,
            count(points.len())
        ))?;
        output.say(Line::HEAD)?;
        let Self { level, radius: radius_m, to, .. } = self;
        let request = NearestRequest { points: &points, level, radius_m, to };
        let searched = search(&map, &request, passes).map_err(CliError::usage)?;
        output.print(&Line::of(&searched))?;
        let queries = points.iter().zip(&searched.nearest.distances_m);
        let queries = queries.map(|(point, distance_m)| (point.xyz(), *distance_m));
        match &self.peer_file {
            Some(path) => peer_file::write(path, &map, radius_m, queries).map_err(CliError::failed),
            None => Ok(()),
        }
    }
}

/// The result.
#[derive(Serialize)]
struct Line {
    ns_per_point: f64,
    points: usize,
    found: usize,
}

impl Line {
    const HEAD: &str = "ns a point       found  of points";

    fn of(searched: &Searched) -> Self {
        Self {
            ns_per_point: searched.runs.median(),
            points: searched.nearest.len(),
            found: searched.nearest.count(),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share = percent(self.found as f64 / self.points.max(1) as f64);
        write!(f, "{:>10.1} {:>11} {share:>10}", self.ns_per_point, count(self.found))
    }
}
