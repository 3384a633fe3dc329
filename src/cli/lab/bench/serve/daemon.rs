//! A server to be asked, in this process, on threads and free ports of its own.

use tokio::runtime::Runtime;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use crate::cli::error::CliError;
use crate::cli::serve::Serving;
use crate::config::Config;
use crate::server::{Server, ServerError};

/// As a daemon of another process would be, but for the memory.
pub(super) struct Daemon {
    serving: Serving,
    shutdown: Option<oneshot::Sender<()>>,
    ended: JoinHandle<Result<(), ServerError>>,
    runtime: Option<Runtime>,
}

impl Daemon {
    pub(super) async fn start() -> Result<Self, CliError> {
        // Maps in memory only: nothing is to be saved.
        let mut config = Config { data_dir: "".into(), ..Config::default() };
        config.http.listen.set_port(0);
        config.grpc.listen.set_port(0);
        let runtime =
            Runtime::new().map_err(|e| CliError::failed(format!("no thread can be started: {e}")))?;
        // Bound there as well, so that sockets wake the server's own threads.
        let server = runtime.spawn(Server::bind(config)).await.map_err(CliError::failed)??;
        let serving = Serving::of(&server);
        let (shutdown, told) = oneshot::channel();
        let ended = runtime.spawn(server.run(async {
            // The sender gone is as good a reason to stop.
            let _ = told.await;
        }));
        Ok(Self { serving, shutdown: Some(shutdown), ended, runtime: Some(runtime) })
    }

    pub(super) fn serving(&self) -> Serving {
        self.serving
    }

    pub(super) async fn stop(mut self) -> Result<(), CliError> {
        self.shutdown = None;
        Ok((&mut self.ended).await.map_err(CliError::failed)??)
    }
}

impl Drop for Daemon {
    /// A runtime must not wait for its threads on a thread of another runtime.
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
