//! The command: the stages, one after the other.

use std::path::PathBuf;
use std::time::Duration;

use super::report::{Line, Verdict};
use super::stage::Stage;
use crate::cli::bench::journal::new_folder;
use crate::cli::bench::workload::{MapOptions, WorkloadOptions};
use crate::fleet::TURN_POINTS;
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench watch                                     fifty replicas of a room that is mapped with 20 scans a second
  mrol-lab bench watch --watchers 8 --seconds 60 --json

A server is started as a process of its own, with the workload's map. Scans are inserted at given poses, and each fourth one is
followed by a deletion of a ball of 1 m: with nobody watching, with --watchers replicas that have a connection each, and with a
watcher besides them that reads nothing. Then the server is killed and started while scans come in. At last it is away from the
replicas for longer than its journal reaches.

At each revision that a replica shows, its hash is compared with the one that was acknowledged to who made the change. The lag is
the time from the acknowledgement until the replica has the revision: 0 where it came first. cpu is the server's, of one core;
robots and replicas work on the same cores. The exit code says whether all hashes were equal, and all replicas were copied anew
exactly where the journal did not reach.";

/// Measure fifty replicas of a map that is mapped: equal hashes, lag, the server's time and memory, restarts
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli::bench) struct WatchBench {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Replicas
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u16).range(1..=200))]
    watchers: u16,
    /// Scans a second
    #[arg(long, value_name = "N", default_value_t = 20.0, value_parser = rate)]
    rate: f64,
    /// Seconds of each stage
    #[arg(long, default_value_t = 20.0, value_parser = rate)]
    seconds: f64,
    /// Points of a scan, at most
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(100..=TURN_POINTS as i64))]
    scan_points: u32,
    /// A folder for the server's data [default: that of temporary files]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
}

impl WatchBench {
    pub(in crate::cli::bench) async fn run(self, output: Output) -> Result<(), CliError> {
        let folder = new_folder(self.folder.as_deref())?;
        let (workload, map) = (&self.workload, &self.map);
        let mut stage = Stage::set(workload, map, self.scan_points, self.rate, folder.path()).await?;
        let voxels = count(stage.voxels());
        output
            .say(format!("{workload}: {voxels} voxels, {} scans/s, {} replicas", self.rate, self.watchers))?;
        output.say(Line::HEAD)?;
        let verdict = self.measure(&mut stage, &output).await?;
        output.print(&verdict)?;
        stage.clear().await?;
        verdict.complaint().map_or(Ok(()), |complaint| Err(CliError::failed(complaint)))
    }

    async fn measure(&self, stage: &mut Stage, output: &Output) -> Result<Verdict, CliError> {
        let time = Duration::from_secs_f64(self.seconds);
        let show = |line: Line| output.print(&line).map(|()| line);
        let alone = show(stage.scans("nobody watches", time).await?)?;
        stage.admit(self.watchers).await?;
        let watched = show(stage.scans("replicas", time).await?)?;
        let stalled = stage.admit_stalled().await?;
        let with_stalled = show(stage.scans("one reads nothing", time).await?)?;
        drop(stalled);
        let killed = show(stage.scans_and_a_kill("killed, started", time).await?)?;
        let away = show(stage.away("journal too short", time / 4).await?)?;
        Ok(Verdict::of(self.watchers, [alone, watched, with_stalled, killed, away]))
    }
}

fn rate(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    (0.1..=1000.0).contains(&number).then_some(number).ok_or_else(|| format!("0.1 to 1000, got {number}"))
}
