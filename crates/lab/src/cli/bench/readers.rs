//! `mrol-lab bench readers`: times readers of one map, alone, at once, and beside a writer.

use std::fmt::{self, Display};
use std::time::Duration;

use serde::Serialize;

use super::workload::{MapOptions, WorkloadOptions, size_of};
use crate::measure::readers::{Crowd, Throughput, run};
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol::console::parse;
use mrol_map::map::{Lookup, MultiResolutionMap};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench readers --workload site --order scan
  mrol-lab bench readers --readers 4 --seconds 10 --json

Readers ask for ten thousand points at a time, as in `mrol-lab bench lookup`; the writer takes the voxels of thirty
thousand of the same points out of the map and puts them in again, without a pause. `of_one` compares with one
reader alone. Each crowd is measured in --rounds rounds that take turns; figures are their medians.";

/// Time readers of one map: one, several at once, one beside a busy writer
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Readers {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// What is asked: the exact set, or the Bloom filter
    #[arg(long, value_parser = parse::keyword::<Lookup>(), default_value = "bloom")]
    lookup: Lookup,
    /// Readers at once
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1024))]
    readers: u16,
    /// Rounds of each crowd
    #[arg(long, value_name = "N", default_value = "5", value_parser = super::workload::times)]
    rounds: usize,
    /// Seconds of a round
    #[arg(long, default_value_t = 1.0)]
    seconds: f64,
}

impl Readers {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let time = Duration::try_from_secs_f64(self.seconds).map_err(CliError::usage)?;
        let map = self.map.map_of(self.workload.workload())?;
        let crowds = [
            Crowd { readers: 1, writer: false },
            Crowd { readers: self.readers.into(), writer: false },
            Crowd { readers: 1, writer: true },
        ];
        let (what, rounds) = (&self.workload, self.rounds);
        output.say(format!("{what}: {}, median of {rounds} rounds of {time:?}", size_of(&map, 0)))?;
        output.say(Line::HEAD)?;
        let medians = self.medians(&map, &crowds, time);
        let alone = medians[0].points_per_s;
        let mut lines = crowds.iter().zip(&medians).map(|(crowd, done)| Line::of(crowd, done, alone));
        lines.try_for_each(|line| output.print(&line))
    }

    fn medians(&self, map: &MultiResolutionMap, crowds: &[Crowd], time: Duration) -> Vec<Throughput> {
        let queries = self.workload.queries(1);
        let mut rounds = vec![Vec::new(); crowds.len()];
        for _ in 0..self.rounds {
            for (crowd, rounds) in crowds.iter().zip(&mut rounds) {
                rounds.push(run(map, &queries, self.lookup, *crowd, time));
            }
        }
        rounds.into_iter().map(middle).collect()
    }
}

/// The round of median throughput.
fn middle(mut rounds: Vec<Throughput>) -> Throughput {
    rounds.sort_unstable_by(|a, b| a.points_per_s.total_cmp(&b.points_per_s));
    rounds[rounds.len() / 2]
}

/// The result of one crowd.
#[derive(Serialize)]
struct Line {
    readers: usize,
    writers: usize,
    points_per_s: f64,
    of_one: f64,
    commits_per_s: f64,
}

impl Line {
    const HEAD: &str = "readers  writers  M points/s  of one reader's  commits/s";

    fn of(crowd: &Crowd, done: &Throughput, alone: f64) -> Self {
        Self {
            readers: crowd.readers,
            writers: crowd.writer.into(),
            points_per_s: done.points_per_s,
            of_one: done.points_per_s / alone,
            commits_per_s: done.commits_per_s,
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:>7} {:>8} {:>11.1} {:>16.2} {:>10.0}",
            self.readers,
            self.writers,
            self.points_per_s / 1e6,
            self.of_one,
            self.commits_per_s
        )
    }
}
