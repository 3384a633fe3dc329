//! The command: a copy of a map, its queries, and how it follows.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::report::{Copied, Line};
use crate::cli::bench::journal::new_folder;
use crate::cli::bench::workload::{MapOptions, WorkloadOptions, times};
use crate::fleet::{CClient, FleetError, Question, Relay, ServerProcess, Target, resident_bytes};
use crate::measure::replica::Compared;
use crate::measure::stopwatch::Runs;
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol_client::{Replica, ReplicaOptions};
use mrol_map::bloom::FilterSettings;
use mrol_map::map::{Lookup, MultiResolutionMap};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench replica                                    a room: time, bytes and memory of a copy, and its queries
  mrol-lab bench replica --workload site --order scan       ten million voxels
  mrol-lab bench replica --c-client target/release/c-query  and through the C library: clients/c/README.md says how it is built

A server is started as a process of its own, with the workload's map. A replica copies it, and another one does so through a
relay that counts bytes. Then the same points are asked, --points at a time: through the replica's map and its locks, as
`mrol-lab bench lookup` does; through the replica; and through a C program with a replica of its own. They take turns, each pass
after one that is not timed; ns_per_point is the median of --repeats passes, and of_map that of each pass against the map's
pass beside it.";

/// Measure a copy of a map that follows: until it is complete, its memory, and its queries against look-ups
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli::bench) struct ReplicaBench {
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Points of a query, several separated by commas
    #[arg(long, value_name = "N", value_delimiter = ',', default_values = ["10000", "100000"], value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: Vec<u32>,
    /// Passes over all points
    #[arg(long, value_name = "N", default_value = "11", value_parser = times)]
    repeats: usize,
    /// The program that clients/c/benches/query.c was compiled to
    #[arg(long, value_name = "FILE")]
    c_client: Option<PathBuf>,
    /// A folder for the server's data [default: that of temporary files]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
}

impl ReplicaBench {
    pub(in crate::cli::bench) async fn run(self, output: Output) -> Result<(), CliError> {
        let folder = new_folder(self.folder.as_deref())?;
        let mut server = ServerProcess::start(&folder.path().join("data")).await?;
        let workload = self.workload.workload();
        let settings = self.map.settings(workload.resolution_m())?;
        let target = Target::make(server.grpc(), None, workload, settings).await?;
        output.say(format!("{}: {} voxels", self.workload, count(target.voxels)))?;
        let (replica, copied) = copy(&server, &target, settings.filter).await?;
        output.print(&copied)?;
        let mut c_client = self.c_client(&server, &target, folder.path(), &output).await?;
        output.say(Line::HEAD)?;
        for &points in &self.points {
            for lookup in [Lookup::Exact, Lookup::Bloom] {
                let lines = self.compare(&replica, c_client.as_mut(), points as usize, lookup).await?;
                lines.iter().try_for_each(|line| output.print(line))?;
            }
        }
        drop((replica, c_client));
        target.delete().await?;
        Ok(server.stop().await?)
    }

    async fn c_client(
        &self,
        server: &ServerProcess,
        target: &Target,
        folder: &std::path::Path,
        output: &Output,
    ) -> Result<Option<CClient>, CliError> {
        let Some(program) = &self.c_client else { return Ok(None) };
        let queries = self.workload.queries(1);
        let client = CClient::start(program, &server.grpc(), &target.map, &queries, folder).await?;
        // The points are the client's too.
        let bytes = client.resident_bytes()?.saturating_sub(12 * queries.points.len() as u64);
        output.note(format!("resident memory of the C client without the points: {} MiB", bytes >> 20));
        Ok(Some(client))
    }

    /// Lets all of them answer the same queries in turn.
    async fn compare(
        &self,
        replica: &Replica,
        mut c_client: Option<&mut CClient>,
        points: usize,
        lookup: Lookup,
    ) -> Result<Vec<Line>, CliError> {
        let queries = self.workload.queries(1);
        let all = queries.points.len();
        let queries = Question::whole(&queries, points, lookup).queries();
        let (mut compared, mut of_c) = (Compared::default(), Runs::default());
        for _ in 0..self.repeats {
            compared.pass(replica, &queries).map_err(CliError::failed)?;
            let [by_replica, by_map] = compared.occupied;
            let mut answers = vec![by_replica, by_map];
            if let Some(client) = &mut c_client {
                let pass = client.pass(lookup, points).await?;
                of_c.push(all, Duration::from_nanos(pass.ns as u64));
                answers.push(pass.occupied);
            }
            if answers.iter().any(|answer| *answer != answers[0]) {
                return Err(CliError::failed(format!("the answers differ: {answers:?} points are occupied")));
            }
        }
        let line = |through, runs: &Runs| {
            Line::of(through, lookup, points, runs.median(), runs.median_ratio(&compared.map))
        };
        let mut lines = vec![line("map", &compared.map), line("replica", &compared.replica)];
        lines.extend(c_client.map(|_| line("C", &of_c)));
        Ok(lines)
    }
}

/// Copies the map: a replica, and what it took.
async fn copy(
    server: &ServerProcess,
    target: &Target,
    filter: Option<FilterSettings>,
) -> Result<(Replica, Copied), FleetError> {
    let open = async |client| {
        // The lookups that are timed ask the filters, too.
        let options = ReplicaOptions { filter, ..ReplicaOptions::default() };
        let opened = Replica::open(client, target.map.clone(), options).await;
        opened.map_err(|error| FleetError::Failed(error.to_string()))
    };
    let own = std::process::id();
    let (before, begin) = (resident_bytes(own)?, Instant::now());
    let replica = open(server.grpc().connect().await?).await?;
    let seconds = begin.elapsed().as_secs_f64();
    let resident_bytes = resident_bytes(own)?.saturating_sub(before);
    let relay = Relay::start(server.grpc_listen()).await?;
    drop(open(relay.grpc().connect().await?).await?);
    let bytes_sent = relay.bytes();
    let (voxels, map_bytes) = (replica.map().voxels(0), map_bytes(&replica.map()));
    Ok((replica, Copied { voxels, seconds, bytes_sent, map_bytes, resident_bytes }))
}

/// Bytes of a map's sets and filters.
fn map_bytes(map: &MultiResolutionMap) -> usize {
    let described = map.describe(0, 0);
    let filters = described.levels.iter().filter_map(|level| level.filter.as_ref());
    let filters = filters.map(|filter| filter.plane_bytes + filter.counter_bytes);
    described.set_bytes + described.moment_bytes + filters.sum::<usize>()
}
