//! The real daemon, in this process, with maps in a temporary folder.

use std::io::ErrorKind;
use std::net::SocketAddr;

use tempfile::TempDir;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use crate::cli::error::CliError;
use crate::cli::output::Output;
use crate::cli::serve::Serving;
use crate::config::Config;
use crate::server::{Server, ServerError};
use crate::telemetry::{LogFormat, start_logging};

/// Only what is wrong: the demonstration itself says what happens.
const LOG_LEVEL: &str = "warn";

pub(super) struct Daemon {
    serving: Serving,
    shutdown: oneshot::Sender<()>,
    task: JoinHandle<Result<(), ServerError>>,
    /// Removed when the daemon is gone.
    _data_dir: TempDir,
}

impl Daemon {
    /// Starts it at the given addresses, or at its usual ones, or where these are taken, at any.
    pub(super) async fn start(
        http: Option<SocketAddr>,
        grpc: Option<SocketAddr>,
        output: &Output,
    ) -> Result<Self, CliError> {
        start_logging(LogFormat::Text, LOG_LEVEL).map_err(CliError::failed)?;
        let data_dir = TempDir::new()
            .map_err(|error| CliError::failed(format!("no temporary folder can be made: {error}")))?;
        let mut config = Config { data_dir: data_dir.path().to_owned(), ..Config::default() };
        config.http.listen = http.unwrap_or(config.http.listen);
        config.grpc.listen = grpc.unwrap_or(config.grpc.listen);
        let server = bind(config, [http.is_some(), grpc.is_some()], output).await?;

        let serving = Serving::of(&server);
        let (shutdown, told) = oneshot::channel();
        let task = tokio::spawn(server.run(async {
            // The sender gone is as good a reason to stop.
            let _ = told.await;
        }));
        Ok(Self { serving, shutdown, task, _data_dir: data_dir })
    }

    pub(super) fn serving(&self) -> Serving {
        self.serving
    }

    /// Lets it finish what it has in hand, save, and go.
    pub(super) async fn stop(self) -> Result<(), CliError> {
        drop(self.shutdown);
        Ok(self.task.await.map_err(CliError::failed)??)
    }
}

/// Binds both addresses; one that is taken and was not asked for gives way to a free port.
async fn bind(mut config: Config, asked_for: [bool; 2], output: &Output) -> Result<Server, CliError> {
    let mut fixed = asked_for;
    loop {
        let ServerError::Listen { protocol, address, error } = (match Server::bind(config.clone()).await {
            Ok(server) => return Ok(server),
            Err(error @ ServerError::Listen { .. }) => error,
            Err(error) => return Err(error.into()),
        }) else {
            continue;
        };
        let (which, listener) = match protocol {
            "http" => (0, &mut config.http),
            _ => (1, &mut config.grpc),
        };
        if fixed[which] || error.kind() != ErrorKind::AddrInUse {
            return Err(ServerError::Listen { protocol, address, error }.into());
        }
        output.note(format!("{address} is taken, {protocol} takes a free port instead"));
        fixed[which] = true;
        listener.listen.set_port(0);
    }
}
