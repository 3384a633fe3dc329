//! `mrol health`: asks whether a server is ready.

use std::fmt;
use std::fmt::Display;
use std::time::Duration;

use serde::Serialize;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;

use super::remote::ServerOptions;
use mrol::console::CliError;
use mrol::console::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol health                                    is the server on this machine ready?
  mrol health --server http://10.0.0.5:7334 && echo ready

Asks by gRPC's health protocol, as load balancers do, without a key. The exit code is 0 where the server serves, and 1 where it
starts, drains, is a node that is behind the others, cannot be reached or does not answer within two seconds: made for a
container's health check.";

/// Ask whether a server is ready; the exit code is the answer
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Health {
    #[command(flatten)]
    server: ServerOptions,
}

/// Longest time to wait for the answer.
const PATIENCE: Duration = Duration::from_secs(2);

const NOT_SERVING: &str = "the server is not ready: it opens its maps, goes down, or is a node that is behind the others (its \
                           /readyz says which)";

#[derive(Debug, Serialize)]
struct Serving {
    serving: bool,
}

impl Display for Serving {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.serving { "serving" } else { "not serving" })
    }
}

impl Health {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let serving = tokio::time::timeout(PATIENCE, is_serving(&self.server)).await;
        let serving = serving.map_err(|_| CliError::failed(format!("no answer within {PATIENCE:?}")))??;
        output.print(&Serving { serving })?;
        if serving { Ok(()) } else { Err(CliError::failed(NOT_SERVING)) }
    }
}

async fn is_serving(server: &ServerOptions) -> Result<bool, CliError> {
    let channel = server.connect().await?.channel();
    // The empty name asks about the server as a whole.
    let answer = HealthClient::new(channel).check(HealthCheckRequest { service: String::new() }).await;
    let answer = answer.map_err(|status| CliError::failed(status.message()))?;
    Ok(answer.into_inner().status() == ServingStatus::Serving)
}
