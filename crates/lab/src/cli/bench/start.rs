//! `mrol-lab bench start`: times the start of a server.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions, times};
use crate::measure::start::{Kept, keep, open};
use crate::workload::Order;
use mrol::console::error::CliError;
use mrol::console::map_report::{bytes, count};
use mrol::console::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench start --workload site                 ten million voxels, from a snapshot and 0 or 32 MiB of journal
  mrol-lab bench start --workload site --journal-mib 16 --folder /mnt/data

A data folder is made, with a snapshot of the workload's map and a journal of scans after it, and a service is opened
on it. The system has the files in memory. Figures are medians of --repeats runs.";

/// Time the start of a server: a snapshot, and the journal after it
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Start {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Points of a scan in the journal
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..))]
    scan_points: u32,
    /// MiB of journal after the snapshot, several separated by commas
    #[arg(long, value_name = "MIB", value_delimiter = ',', default_values = ["0", "32"])]
    journal_mib: Vec<u32>,
    /// A folder on the disk in question [default: that of temporary files]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Number of starts
    #[arg(long, value_name = "N", default_value = "5", value_parser = times)]
    repeats: usize,
}

impl Start {
    pub(super) fn run(mut self, output: &Output) -> Result<(), CliError> {
        self.workload = self.workload.usually(Order::Scan);
        let settings = self.map.settings(self.workload.workload().resolution_m())?;
        let map = self.workload.workload().map(settings).map_err(CliError::usage)?;
        let points = self.workload.queries(1);
        let voxels = count(map.voxels(0));
        output.say(format!("{}: {voxels} voxels, median of {} starts", self.workload, self.repeats))?;
        output.say(Line::HEAD)?;
        for &mib in &self.journal_mib {
            let folder = super::journal::new_folder(self.folder.as_deref())?;
            let kept = keep(folder.path(), &map, &points, self.scan_points as usize, u64::from(mib) << 20)?;
            let runs = open(folder.path(), self.repeats).map_err(CliError::failed)?;
            output.print(&Line::of(map.voxels(0), kept, runs.median()))?;
        }
        Ok(())
    }
}

#[derive(Serialize)]
struct Line {
    voxels: usize,
    snapshot_bytes: usize,
    journal_bytes: u64,
    records: u64,
    seconds: f64,
}

impl Line {
    const HEAD: &str = "    snapshot       journal   records   seconds";

    fn of(voxels: usize, kept: Kept, ns: f64) -> Self {
        let Kept { snapshot_bytes, journal_bytes, records } = kept;
        Self { voxels, snapshot_bytes, journal_bytes, records, seconds: ns / 1e9 }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (snapshot, journal) = (bytes(self.snapshot_bytes), bytes(self.journal_bytes as usize));
        write!(f, "{snapshot:>12} {journal:>13} {:>9} {:>9.2}", self.records, self.seconds)
    }
}
