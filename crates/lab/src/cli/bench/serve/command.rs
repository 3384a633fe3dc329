//! The command: a load of queries for each protocol and size of messages.

use std::time::Duration;

use super::protocol::Protocol;
use super::report::Line;
use crate::cli::bench::workload::{MapOptions, WorkloadOptions};
use crate::fleet::{GrpcAddress, HttpAddress, Load, Question, Target};
use mrol::console::CredentialOptions;
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol::console::parse;
use mrol::server::Daemon;
use mrol_map::map::Lookup;
use mrol_map::util::Keyword;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench serve                                            a server of its own, on the same cores
  mrol-lab bench serve --protocols grpc --points 10000 --connections 4 --seconds 10
  mrol-lab bench serve --server http://robot-7:7334 --http http://robot-7:7333 --workload site --json

On the server a map of the workload is made under a name of its own, and deleted at the end. Each connection asks
again as soon as it is answered; on a stream --in-flight messages are under way. The time of an answer is that from
handing over the question to having the bitmap. A tenth of the time goes by before the clock runs.";

/// Put a load of point queries on a server: answers a second, and how long they take
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli::bench) struct Serve {
    /// The gRPC address of a running server [default: a server is started in this process]
    #[arg(long, value_name = "URL")]
    server: Option<String>,
    /// The HTTP address of the same server; without it only gRPC is measured there
    #[arg(long, value_name = "URL", requires = "server")]
    http: Option<String>,
    #[command(flatten)]
    credentials: CredentialOptions,
    #[command(flatten)]
    workload: WorkloadOptions,
    #[command(flatten)]
    map: MapOptions,
    /// Protocols of the queries, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["grpc", "grpc-stream", "http"])]
    protocols: Vec<Protocol>,
    /// Points of a message, several separated by commas
    #[arg(long, value_name = "N", value_delimiter = ',', default_values = ["1000", "10000", "100000", "1000000"], value_parser = message_points)]
    points: Vec<usize>,
    /// What is asked: the exact set, or the Bloom filter
    #[arg(long, value_parser = parse::keyword::<Lookup>(), default_value = "bloom")]
    lookup: Lookup,
    /// Connections that ask at once
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    connections: u16,
    /// Messages under way on a stream
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1024))]
    in_flight: u16,
    /// Seconds of each measurement
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
}

impl Serve {
    pub(in crate::cli::bench) async fn run(self, output: Output) -> Result<(), CliError> {
        let time = Duration::try_from_secs_f64(self.seconds).map_err(CliError::usage)?;
        let workload = self.workload.workload();
        let settings = self.map.settings(workload.resolution_m())?;
        let daemon = match self.server {
            Some(_) => None,
            None => Some(Daemon::start_in_memory().await?),
        };
        let (grpc, http) = self.addresses(daemon.as_ref(), &output)?;
        let target = Target::make(grpc, http, workload, settings).await?;
        let measured = self.measure(&target, time, &output).await;
        target.delete().await?;
        if let Some(daemon) = daemon {
            daemon.stop().await?;
        }
        measured
    }

    /// Addresses of the server: gRPC, and HTTP if it is known.
    fn addresses(
        &self,
        daemon: Option<&Daemon>,
        output: &Output,
    ) -> Result<(GrpcAddress, Option<HttpAddress>), CliError> {
        if let Some(daemon) = daemon {
            let (grpc, http) = (daemon.grpc().to_string(), format!("http://{}", daemon.http()));
            return Ok((GrpcAddress::open(grpc), Some(HttpAddress::open(http))));
        }
        if self.http.is_none() && self.protocols.contains(&Protocol::Http) {
            output.note("http is left out: --http says where the server has it");
        }
        let url = self.server.clone().unwrap_or_default();
        let http = match &self.http {
            Some(url) => Some(HttpAddress::new(url, self.credentials.secret()?.as_deref())?),
            None => None,
        };
        Ok((GrpcAddress { url, credentials: self.credentials.read()? }, http))
    }

    async fn measure(&self, target: &Target, time: Duration, output: &Output) -> Result<(), CliError> {
        let (voxels, connections) = (count(target.voxels), self.connections);
        let (workload, lookup) = (&self.workload, self.lookup.as_str());
        output.say(format!("{workload}: {voxels} voxels, {lookup} look-ups, {connections} connections"))?;
        output.say(Line::HEAD)?;
        let queries = self.workload.queries(1);
        for &points in &self.points {
            let question = Question::of(&queries, points, self.lookup);
            for &protocol in &self.protocols {
                let Some(load) = self.load(protocol, target, &question) else { continue };
                // A warm-up, until connections, windows and caches have settled.
                load.run(self.connections.into(), time / 10).await?;
                let answered = load.run(self.connections.into(), time).await?;
                output.print(&Line::of(protocol, points, &answered))?;
            }
        }
        Ok(())
    }

    fn load(&self, protocol: Protocol, target: &Target, question: &Question) -> Option<Load> {
        let (server, map, question) = (target.grpc.clone(), target.map.clone(), question.clone());
        match protocol {
            Protocol::Grpc => Some(Load::Unary { server, map, question }),
            Protocol::GrpcStream => {
                Some(Load::Stream { server, map, question, in_flight: self.in_flight.into() })
            }
            Protocol::Http => {
                target.http.as_ref().map(|http| Load::Http { http: question.asked_at(http, &map), question })
            }
        }
    }
}

fn message_points(text: &str) -> Result<usize, String> {
    let points: usize = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    (1..=2_000_000).contains(&points).then_some(points).ok_or_else(|| format!("1 to 2000000, got {points}"))
}
