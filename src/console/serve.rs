//! `mrol serve`: runs the daemon.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::pin::pin;

use mrol_service::ServiceSettings;
use mrol_store::{DataDir, LeftMap};
use serde_json::json;
use tokio::task::spawn_blocking;

use crate::config::{Config, ConfigError, unknown_variables};
use crate::server::{Hangups, Server, exit_after, exit_when_told, shutdown_signal};
use crate::telemetry::start_logging;

use super::error::CliError;
use super::output::Output;
use super::serving::Serving;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol serve                                     maps are kept in ./mrol-data
  mrol serve --data-dir /var/lib/mrol --keys-file keys.toml --http-listen 0.0.0.0:7333 --grpc-listen 0.0.0.0:7334
                                                 for other machines, which need keys (`mrol key new`)
  mrol serve --config mrol.toml --tls-certificate server.pem --tls-key server.key
                                                 over TLS, which keeps keys from being read on their way; the rest of
                                                 the settings from a file that `mrol config print > mrol.toml` began
  mrol serve --data-dir \"\"                       keep maps in memory only
  mrol serve --http-listen 127.0.0.1:0 --grpc-listen 127.0.0.1:0 --json
                                                 take free ports and print them as JSON
  mrol serve --grpc-socket /run/mrol/grpc.sock   clients on this machine connect to unix:/run/mrol/grpc.sock
  mrol serve --cluster nats://10.0.0.1:4222,nats://10.0.0.2:4222 --node n1
                                                 share the maps with other nodes (docs/guide/cluster.md)
  mrol serve --leave-cluster                     take this data folder out of its cluster for good, and serve it alone
  MROL_LIMITS__MAPS_MAX=4 mrol serve             any setting as a variable: limits.maps_max, with two underscores

The first line on standard output has the addresses; the log goes to standard error. Settings come from defaults,
then the file of --config (TOML), then MROL_... variables, then the options here.

SIGTERM and Ctrl-C end the server: requests in flight are finished and maps are saved, within a time limit even where
a disk hangs. The second signal ends it at once. SIGHUP reads keys and certificates again. With a data folder and
--durability \"always\", no acknowledged change is lost, however the server ends. With an interval, a loss of power
takes the changes of the last interval.";

/// Run the daemon: hold maps, take scans and answer queries over HTTP and gRPC
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Serve {
    #[command(flatten)]
    options: ServeOptions,
    /// Take the data folder out of its cluster for good, then serve it alone: every map gets a new uuid, and undo does
    /// not reach behind. Not with --cluster
    #[arg(long)]
    leave_cluster: bool,
}

/// Options that override settings of the daemon.
#[derive(Debug, clap::Args)]
pub struct ServeOptions {
    /// Settings to start from, TOML; variables and options override them
    #[arg(long, env = "MROL_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// Where maps are kept across restarts; "" keeps them in memory only [default: ./mrol-data]
    #[arg(long, value_name = "DIR")]
    data_dir: Option<String>,
    /// Address of HTTP; port 0 takes a free one [default: 127.0.0.1:7333]
    #[arg(long, value_name = "ADDRESS")]
    http_listen: Option<SocketAddr>,
    /// Address of gRPC; port 0 takes a free one [default: 127.0.0.1:7334]
    #[arg(long, value_name = "ADDRESS")]
    grpc_listen: Option<SocketAddr>,
    /// Address at which health and metrics are served once more, and nothing else, for monitors [default: none]
    #[arg(long, value_name = "ADDRESS")]
    admin_listen: Option<SocketAddr>,
    /// A Unix socket to serve gRPC at as well, for clients on this machine (unix:PATH)
    #[arg(long, value_name = "PATH")]
    grpc_socket: Option<PathBuf>,
    /// A Unix socket to serve HTTP at as well (curl --unix-socket PATH)
    #[arg(long, value_name = "PATH")]
    http_socket: Option<PathBuf>,
    /// The file of keys that callers need, made by `mrol key new`; read again when it changes
    #[arg(long, value_name = "FILE")]
    keys_file: Option<PathBuf>,
    /// The server's certificate (PEM) for TLS, its signers after it; read again when it changes
    #[arg(long, value_name = "FILE")]
    tls_certificate: Option<PathBuf>,
    /// The private key (PEM) of the server's certificate
    #[arg(long, value_name = "FILE")]
    tls_key: Option<PathBuf>,
    /// Certificates (PEM) of who may sign those of clients, which then need one to connect
    #[arg(long, value_name = "FILE")]
    tls_client_ca: Option<PathBuf>,
    /// Listen beyond loopback without keys: whoever reaches the ports may do everything. Not with --keys-file
    #[arg(long)]
    insecure_open: bool,
    /// Be a node of a cluster, which shares its maps with others by way of these NATS servers: nats://HOST:PORT,...
    /// Needs --node, and a data folder
    #[arg(long, value_name = "URLS", value_delimiter = ',')]
    cluster: Option<Vec<String>>,
    /// The name of this node, which no other has
    #[arg(long, value_name = "NAME")]
    node: Option<String>,
    /// How log lines are written: text or json [default: text]
    #[arg(long, value_name = "FORMAT", value_parser = ["text", "json"])]
    log_format: Option<String>,
    /// Least level of log lines, or a list of target=level [default: info]
    #[arg(long, value_name = "LEVEL")]
    log_level: Option<String>,
    /// When a change is acknowledged: "always" when it is synced, or synced at an interval (200ms, 1s)
    /// [default: always]
    #[arg(long, value_name = "WHEN")]
    durability: Option<String>,
    /// MiB of journal after which a map is written to a snapshot [default: 32]
    #[arg(long, value_name = "MIB")]
    snapshot_journal_mib: Option<u64>,
    /// Seconds after which a map that changed is written to a snapshot [default: 300]
    #[arg(long, value_name = "SECONDS")]
    snapshot_interval_s: Option<u64>,
    /// Seconds for requests in flight when the server ends, and for saving the maps after them [default: 10]
    #[arg(long, value_name = "SECONDS")]
    drain_seconds: Option<u64>,
    /// Seconds that the server goes on serving when it is told to end, while /readyz says that it is not ready
    /// [default: 0]
    #[arg(long, value_name = "SECONDS")]
    drain_delay_s: Option<u64>,
}

impl Serve {
    /// Serves until it is told to end.
    ///
    /// # Errors
    /// When settings are wrong, or the server cannot start or ends by an error.
    pub async fn run(self, output: Output) -> Result<(), CliError> {
        let config = self.options.config().map_err(CliError::usage)?;
        if self.leave_cluster && config.cluster.is_used() {
            let (one, other) = ("--leave-cluster", "cluster.nats (--cluster)");
            return Err(CliError::usage(ConfigError::Contradiction { one, other }));
        }
        let _logging =
            start_logging(config.log.format, &config.log.level, config.log.audit).map_err(CliError::usage)?;
        for variable in unknown_variables() {
            tracing::warn!(variable, "is no setting and of no use here");
        }
        for constant in &config.constants_set {
            tracing::warn!(constant, "is a constant, and what is set of it does not count");
        }
        let (hangups, mut shutdown) = (Hangups::hear(), pin!(shutdown_signal()));
        let begun = async {
            if self.leave_cluster {
                leave_cluster(&config).await?;
            }
            Ok::<_, CliError>(Server::bind(config).await?)
        };
        // Signals are handled from here on. The thread that opens maps is then abandoned at any point: nothing was
        // acknowledged, and files are written as a whole or not at all.
        let server = tokio::select! {
            biased;
            () = &mut shutdown => {
                tracing::info!("told to end while the maps are being opened: ends, nothing is lost");
                return Ok(());
            }
            server = begun => server?,
        };
        tokio::spawn(hangups.reload(server.files()));
        match output.print(&Serving::of(&server)) {
            // The daemon also runs without a reader of its output.
            Ok(()) | Err(CliError::OutputClosed) => {}
            Err(error) => return Err(error),
        }
        let down_within = server.down_within();
        let shutdown = async {
            shutdown.await;
            exit_after(down_within);
            tokio::spawn(exit_when_told());
        };
        Ok(server.run(shutdown).await?)
    }
}

/// Takes the data folder out of its cluster. Ended at any moment, it is to be done again, and nothing is lost.
async fn leave_cluster(config: &Config) -> Result<(), CliError> {
    let ServiceSettings { data_dir, store, .. } = config.service_settings();
    let Some(data_dir) = data_dir else {
        return Err(CliError::usage("--leave-cluster is of no use without a data folder (data_dir is \"\")"));
    };
    let leave = move || {
        DataDir::open(&data_dir, store)?.leave_cluster(|LeftMap { name, revision, before, now }| {
            tracing::info!(map = %name, revision, %before, %now, "has a uuid of its own now");
        })
    };
    let left = spawn_blocking(leave).await.map_err(CliError::failed)?;
    match left {
        Ok(Some(node)) => {
            tracing::info!(node, "the data folder has left the cluster: this server is by itself")
        }
        Ok(None) => tracing::info!("the data folder belongs to no node of a cluster: nothing is to be done"),
        Err(error) => {
            let message = format!(
                "the data folder still belongs to the cluster: {error}; once that is put right, start with --leave-cluster again"
            );
            return Err(CliError::failed(message));
        }
    }
    Ok(())
}

impl ServeOptions {
    /// The effective settings.
    pub fn config(&self) -> Result<Config, ConfigError> {
        let options = json!({
            "data_dir": self.data_dir,
            "http": {"listen": self.http_listen, "socket": self.http_socket},
            "grpc": {"listen": self.grpc_listen, "socket": self.grpc_socket},
            "admin": {"listen": self.admin_listen},
            "access": {"keys_file": self.keys_file, "open": self.insecure_open.then_some(true)},
            "cluster": {"nats": self.cluster, "node": self.node},
            "tls": {"certificate": self.tls_certificate, "key": self.tls_key, "client_ca": self.tls_client_ca},
            "log": {"format": self.log_format, "level": self.log_level},
            "store": {
                "durability": self.durability,
                "snapshot_journal_mib": self.snapshot_journal_mib,
                "snapshot_interval_s": self.snapshot_interval_s,
            },
            "drain_seconds": self.drain_seconds,
            "drain_delay_s": self.drain_delay_s,
        });
        Config::load(self.config.as_deref(), options)
    }
}
