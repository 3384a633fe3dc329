//! `mrol-lab bench growth`: measures memory and latencies while a map grows.

use std::fmt::{self, Display};

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions};
use crate::measure::growth::{READ_POINTS, peak_resident_bytes, watch};
use mrol::console::error::CliError;
use mrol::console::map_report::{bytes, count};
use mrol::console::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench growth --workload site                  ten million voxels
  mrol-lab bench growth --workload site --site-voxels 50000000 --json

The workload goes in piece by piece (up to 131 thousand voxels each), and is never held as a whole; one thread asks for
640 points every 50 us meanwhile. Commits are told apart by whether a filter had to be made larger. Memory is the
most that the whole process held.";

/// Let a map grow: bytes a voxel, peak memory, how long writers and readers wait
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Growth {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
}

impl Growth {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let workload = self.workload.workload();
        let settings = self.map.settings(workload.resolution_m())?;
        let growth = watch(workload, settings, self.workload.seed()).map_err(CliError::usage)?;
        let (least, most) = growth.bytes_per_voxel;
        output.print(&Report {
            voxels: growth.voxels,
            bytes_per_voxel_min: least,
            bytes_per_voxel_max: most,
            peak_resident_bytes: peak_resident_bytes(),
            commits: Waits::of(&growth.commits_ms),
            growing_commits: Waits::of(&growth.growing_commits_ms),
            reads_us: Waits::of(&growth.reads_us.iter().map(|&us| us.into()).collect::<Vec<f64>>()),
        })
    }
}

#[derive(Serialize)]
struct Report {
    voxels: usize,
    bytes_per_voxel_min: f64,
    bytes_per_voxel_max: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_resident_bytes: Option<usize>,
    /// Durations of commits that did not enlarge a filter, milliseconds.
    commits: Waits,
    /// Durations of commits that enlarged a filter, milliseconds.
    growing_commits: Waits,
    reads_us: Waits,
}

/// Statistics of durations.
#[derive(Serialize)]
struct Waits {
    number: usize,
    median: f64,
    p99: f64,
    max: f64,
}

impl Waits {
    /// The statistics of ascending times.
    fn of(times: &[f64]) -> Self {
        let at = |share: f64| {
            let place = (share * times.len().saturating_sub(1) as f64).round() as usize;
            times.get(place).copied().unwrap_or(0.0)
        };
        Self { number: times.len(), median: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (least, most) = (self.bytes_per_voxel_min, self.bytes_per_voxel_max);
        writeln!(f, "{} voxels, {least:.1} to {most:.1} bytes a voxel on the way", count(self.voxels))?;
        if let Some(peak) = self.peak_resident_bytes {
            writeln!(f, "the process held {} at most", bytes(peak))?;
        }
        writeln!(f, "commits in place: {}", self.commits.in_unit("ms"))?;
        writeln!(f, "commits that grew: {}", self.growing_commits.in_unit("ms"))?;
        write!(f, "reads of {READ_POINTS} points meanwhile: {}", self.reads_us.in_unit("us"))
    }
}

impl Waits {
    fn in_unit(&self, unit: &str) -> String {
        let Self { number, median, p99, max } = self;
        format!("{}, median {median:.2} {unit}, p99 {p99:.2}, longest {max:.2}", count(*number))
    }
}
