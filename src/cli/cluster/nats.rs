//! How a command reaches the NATS servers of a cluster.

use std::path::PathBuf;

use serde_json::json;

use mrol::config::Config;
use mrol::console::CliError;
use mrol::server::engine_settings;
use mrol_cluster::{ClusterStore, EngineSettings, NoStore, OverviewReader, StreamError};

/// Name of a command in the settings, which want one of a node. The NATS servers list its connection as this.
const NODE: &str = "command";

/// Options by which a command reaches NATS.
#[derive(Debug, clap::Args)]
pub(super) struct NatsOptions {
    /// Settings of a node, TOML, of which section `cluster` counts; MROL_CLUSTER__... variables override it
    #[arg(long, env = "MROL_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// The NATS servers of the cluster, with commas between them: nats://HOST:PORT, or tls:// for TLS
    #[arg(long, value_name = "URLS", value_delimiter = ',')]
    nats: Option<Vec<String>>,
}

impl NatsOptions {
    /// The settings, whose section `cluster` has NATS servers.
    pub(super) fn settings(&self) -> Result<Config, CliError> {
        let options = json!({"cluster": {"nats": self.nats, "node": NODE}});
        let config = Config::load(self.config.as_deref(), options).map_err(CliError::usage)?;
        if !config.cluster.is_used() {
            return Err(CliError::usage(
                "no NATS servers are given: --nats nats://HOST:PORT,... names them, or --config FILE with cluster.nats",
            ));
        }
        Ok(config)
    }

    /// What the nodes of the cluster keep at NATS. Not for an async thread.
    pub(super) fn find(&self) -> Result<ClusterStore, CliError> {
        let settings = self.settings()?;
        let engine = engine_of(&settings);
        ClusterStore::find(&engine).map_err(|error| match error {
            NoStore::Stream(StreamError::Missing(stream)) => CliError::failed(format!(
                "these NATS servers have no cluster yet (no stream {stream}): start a node (`mrol serve --cluster URLS --node \
                 NAME`), or take the maps of a server in (`mrol cluster adopt DATA_DIR`)"
            )),
            error => CliError::failed(error),
        })
    }

    /// Looks at the cluster, first.
    pub(super) fn reader(&self) -> Result<OverviewReader, CliError> {
        OverviewReader::begin(self.find()?).map_err(CliError::failed)
    }
}

/// How a command with these settings reaches NATS.
pub(super) fn engine_of(settings: &Config) -> EngineSettings {
    engine_settings(&settings.cluster, NODE)
}
