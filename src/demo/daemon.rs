//! The daemon of the demonstration, with maps in a temporary folder.

use std::net::SocketAddr;

use tempfile::TempDir;

use mrol::config::Config;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::Serving;
use mrol::server;
use mrol::telemetry::{LogFormat, Logging, start_logging};

/// Log level: only problems, since the demonstration itself says what happens.
const LOG_LEVEL: &str = "warn";
/// Seconds that a planner's question may take: nobody else waits for its map, and the machine may have other work.
const QUESTION_TIME_MAX_S: f64 = 5.0;

pub(super) struct Daemon {
    daemon: server::Daemon,
    /// Data folder, removed when the daemon is dropped.
    _data_dir: TempDir,
    _logging: Logging,
}

impl Daemon {
    /// Starts the daemon at the given addresses, or at the default ones, or where these are in use, at free ports.
    pub(super) async fn start(
        http: Option<SocketAddr>,
        grpc: Option<SocketAddr>,
        output: &Output,
    ) -> Result<Self, CliError> {
        let logging = start_logging(LogFormat::Text, LOG_LEVEL, false).map_err(CliError::failed)?;
        let data_dir = TempDir::new()
            .map_err(|error| CliError::failed(format!("no temporary folder can be made: {error}")))?;
        let mut config = Config { data_dir: data_dir.path().to_owned(), ..Config::default() };
        config.http.listen = http.unwrap_or(config.http.listen);
        config.grpc.listen = grpc.unwrap_or(config.grpc.listen);
        config.limits.question_time_max_s = QUESTION_TIME_MAX_S;
        let (output, is_asked_for) = (output.clone(), move |protocol| match protocol {
            "http" => http.is_some(),
            _ => grpc.is_some(),
        });
        let instead = move |server::Taken { protocol, mut address }| {
            // A free port is never taken.
            if is_asked_for(protocol) || address.port() == 0 {
                return None;
            }
            output.note(format!("{address} is taken, {protocol} takes a free port instead"));
            address.set_port(0);
            Some(address)
        };
        let daemon = server::Daemon::start(config, instead).await?;
        Ok(Self { daemon, _data_dir: data_dir, _logging: logging })
    }

    pub(super) fn serving(&self) -> Serving {
        Serving { http: self.daemon.http(), grpc: self.daemon.grpc(), admin: None, tls: false }
    }

    /// Stops the daemon: it completes requests in flight, saves its maps and ends.
    pub(super) async fn stop(self) -> Result<(), CliError> {
        Ok(self.daemon.stop().await?)
    }
}
