//! `mrol cluster check`: is everything as it must be?

use std::time::Duration;

use tokio::runtime::Runtime;

use super::findings::{Finding, copies_of_maps, monitored, nodes, streams};
use super::hashes;
use super::monitor::{ServerFacts, monitor_url};
use crate::cli::cluster::nats::NatsOptions;
use mrol::console::{CliError, CredentialOptions, Output, count};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster check --nats nats://10.0.0.1:4222 --key-file admin.key
  mrol cluster check --config mrol.toml --monitor http://10.0.0.1:8222 --monitor http://10.0.0.2:8222
                                                 also whether the NATS servers sync what they acknowledge

The exit code is 1 where something is WRONG, 0 else. Contents are compared by asking each node for the version of each map until
two say it of the same revision; of a map that changes all the time none may be found. That takes a key that may read the maps,
where nodes ask for one.";

/// Check replicas, versions, copies, contents, disks and, with --monitor, the NATS servers
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli::cluster) struct Check {
    #[command(flatten)]
    nats: NatsOptions,
    /// The monitoring port of a NATS server, http://HOST:PORT; may be repeated, once for each server
    #[arg(long, value_name = "URL", value_parser = monitor_url)]
    monitor: Vec<String>,
    #[command(flatten)]
    credentials: CredentialOptions,
}

/// How long contents are compared.
const COMPARED_WITHIN: Duration = Duration::from_secs(6);

impl Check {
    pub(in crate::cli::cluster) fn run(self, output: &Output) -> Result<(), CliError> {
        let credentials = self.credentials.read()?;
        let wanted = self.nats.settings()?.cluster.replicas as usize;
        let reader = self.nats.reader()?;
        let engine = &reader.store().engine;
        // A connection is refused to servers that are older or take smaller messages.
        let detail = format!(
            "{} at {}, messages of {} bytes",
            engine.server_version(),
            engine.servers(),
            count(engine.max_payload())
        );
        let mut findings = vec![Finding::good("nats", detail)];
        findings.extend(monitored(self.monitor.iter().map(|url| (url, ServerFacts::ask(url)))));
        let seen = reader.settled().map_err(CliError::failed)?;
        findings.extend(streams(
            &reader.store().stream_copies(seen.maps.iter().map(|map| map.uuid)),
            &seen,
            wanted,
        ));
        findings.extend(nodes(&seen.nodes));
        findings.extend(copies_of_maps(&seen));
        let runtime = Runtime::new().map_err(CliError::failed)?;
        findings.extend(runtime.block_on(hashes::compared(&seen, &credentials, COMPARED_WITHIN)));
        findings.iter().try_for_each(|finding| output.print(finding))?;
        match findings.iter().filter(|finding| finding.is_wrong()).count() {
            0 => Ok(()),
            1 => Err(CliError::failed("one thing is wrong")),
            wrong => Err(CliError::failed(format!("{wrong} things are wrong"))),
        }
    }
}
