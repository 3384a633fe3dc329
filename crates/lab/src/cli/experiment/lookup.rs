//! `mrol-lab experiment lookup`: times the stages of a look-up, as in Fig. 1 of the paper.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use crate::cli::bench::workload::{MapOptions, size_of};
use crate::experiment::stages::{Stage, measure};
use crate::report::chart::box_plot;
use crate::report::{Table, folder};
use crate::workload::{Order, Scatter, Workload};
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment lookup --out results/
  mrol-lab experiment lookup --out results/ --runs 30 --json

\"Fig. 1 compares the execution times of various aspects of the process required to lookup a random point in a map
consisting of randomly generated voxels\": 142,812 voxels of 0.05 m, as many as the paper's map of real scans has.
Look-ups by themselves begin with keys (the dense array with offsets) that were made beforehand; the set
intersection makes a set of the keys first. On one core. Writes lookup.svg and lookup.csv.";

/// Experiment 1 of the paper: a box plot of the stages of a look-up
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Lookup {
    /// Where to write lookup.svg and lookup.csv; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Runs of each stage
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(2..=1000))]
    runs: u16,
    /// Points of a run
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    points: u32,
    /// Seed of voxels and points
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

impl Lookup {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        folder(&self.out)?;
        let scatter = Workload::Scatter(Scatter::of(Scatter::VOXELS, self.seed));
        let map = self.map.map_of(scatter)?;
        let queries = scatter.queries(Order::Random, self.points as usize, self.seed.wrapping_add(1));
        let (size, points) = (size_of(&map, 0), count(queries.points.len()));
        output.say(format!("{size} at random, {points} points at random, {} runs", self.runs))?;
        let stages = measure(&map, &queries, self.runs.into()).map_err(CliError::failed)?;
        output.say(Line::HEAD)?;
        stages.iter().try_for_each(|stage| output.print(&Line::of(stage)))?;
        self.write(&stages, &size)
    }

    fn write(&self, stages: &[Stage], size: &str) -> Result<(), CliError> {
        let mut table = Table::new(["stage", "run", "ns_per_point"]);
        for stage in stages {
            for (run, ns) in stage.runs.ns_per_item().iter().enumerate() {
                table.push([stage.name, &(run + 1).to_string(), &format!("{ns:.4}")]);
            }
        }
        table.write_csv(&self.out.join("lookup.csv"))?;
        let title = format!("Time to look up a point, one core, {size} ({} runs)", self.runs);
        Ok(box_plot(&self.out.join("lookup.svg"), &title, stages)?)
    }
}

/// The result of one stage, nanoseconds a point.
#[derive(Serialize)]
struct Line {
    stage: &'static str,
    ns_per_point: f64,
    min: f64,
    max: f64,
}

impl Line {
    const HEAD: &str = "stage                                 median ns a point     min     max";

    fn of(stage: &Stage) -> Self {
        let runs = stage.runs.ns_per_item();
        Self {
            stage: stage.name,
            ns_per_point: stage.runs.median(),
            min: runs.iter().copied().fold(f64::INFINITY, f64::min),
            max: runs.iter().copied().fold(0.0, f64::max),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stage, ns_per_point, min, max } = self;
        write!(f, "{stage:<38}{ns_per_point:>17.2} {min:>7.2} {max:>7.2}")
    }
}
