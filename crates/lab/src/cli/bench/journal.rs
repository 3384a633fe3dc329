//! `mrol-lab bench journal`: measures the cost of durability.

use std::fmt::{self, Display};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions, times};
use crate::measure::journal::{Keeping, Scans, insert};
use crate::measure::stopwatch::Runs;
use crate::workload::Order;
use mrol::console::error::CliError;
use mrol::console::map_report::{bytes, count};
use mrol::console::output::Output;
use mrol_store::Durability;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench journal --workload site               eight robots that drive through the site
  mrol-lab bench journal --folder /mnt/data --robots 1     one robot, on another disk
  mrol-lab bench journal --durability always,100ms --json

The same scans at the same poses, with and without a journal, on a new map each time and in turn. Each robot sends its
next scan when the last one is acknowledged; nothing goes over a network. Figures are medians of --repeats runs.";

/// Time insertion with a journal and without: the cost of durability
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Journal {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Points of a scan
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..))]
    scan_points: u32,
    /// Robots that send at once
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1024))]
    robots: u16,
    /// When a scan is acknowledged, several separated by commas: always, or synced at an interval
    #[arg(long, value_name = "WHEN", value_delimiter = ',', default_values = ["always", "200ms"])]
    durability: Vec<Durability>,
    /// A folder on the disk in question [default: that of temporary files]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Runs, each with a new map
    #[arg(long, value_name = "N", default_value = "5", value_parser = times)]
    repeats: usize,
}

impl Journal {
    pub(super) async fn run(mut self, output: Output) -> Result<(), CliError> {
        self.workload = self.workload.usually(Order::Scan);
        let workload = &self.workload;
        let settings = self.map.settings(workload.workload().resolution_m())?;
        let scans = Scans::of(&workload.queries(1), self.scan_points as usize, self.robots.into());
        output.say(format!(
            "{workload}: {} scans of {} points, {} robots at once, median of {} runs",
            count(scans.len()),
            count(self.scan_points as usize),
            self.robots,
            self.repeats
        ))?;
        output.say(Line::HEAD)?;
        let on_disk = self.durability.iter().map(|&durability| Keeping::OnDisk(durability));
        let mut measured: Vec<_> = std::iter::once(Keeping::InMemory)
            .chain(on_disk)
            .map(|keeping| (keeping, Runs::default(), 0))
            .collect();
        for _ in 0..self.repeats {
            for (keeping, runs, journal) in &mut measured {
                let folder = new_folder(self.folder.as_deref())?;
                let (elapsed, bytes) =
                    insert(settings, &scans, *keeping, folder.path()).await.map_err(CliError::failed)?;
                runs.push(scans.len(), elapsed);
                *journal = bytes;
            }
        }
        let without_ns = measured[0].1.median();
        let line = |(keeping, runs, journal): &(Keeping, Runs, u64)| {
            Line::of(*keeping, runs.median(), without_ns, *journal as usize / scans.len())
        };
        measured.iter().try_for_each(|measured| output.print(&line(measured)))
    }
}

/// An empty folder, in `folder` or among temporary files.
pub(super) fn new_folder(folder: Option<&Path>) -> Result<tempfile::TempDir, CliError> {
    let made = folder.map_or_else(tempfile::tempdir, tempfile::tempdir_in);
    made.map_err(|error| CliError::failed(format!("no folder can be made: {error}")))
}

#[derive(Serialize)]
struct Line {
    keeping: String,
    ms_per_scan: f64,
    scans_per_s: f64,
    /// Duration relative to the one without a journal.
    times_as_long: f64,
    journal_bytes_per_scan: usize,
}

impl Line {
    const HEAD: &str = "keeping    ms a scan    scans/s   times as long   journal a scan";

    fn of(keeping: Keeping, ns_per_scan: f64, without_ns: f64, journal_bytes_per_scan: usize) -> Self {
        Self {
            keeping: match keeping {
                Keeping::InMemory => "in memory".into(),
                Keeping::OnDisk(durability) => durability.to_string(),
            },
            ms_per_scan: ns_per_scan / 1e6,
            scans_per_s: 1e9 / ns_per_scan,
            times_as_long: ns_per_scan / without_ns,
            journal_bytes_per_scan,
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<10} {:>9.3} {:>10.0} {:>15.2} {:>16}",
            self.keeping,
            self.ms_per_scan,
            self.scans_per_s,
            self.times_as_long,
            bytes(self.journal_bytes_per_scan)
        )
    }
}
