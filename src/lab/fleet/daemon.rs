//! The real daemon in this process, on threads of its own.

use std::io::ErrorKind;
use std::net::SocketAddr;

use tokio::runtime::Runtime;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use super::FleetError;
use crate::config::Config;
use crate::server::{Server, ServerError};

/// A daemon as in another process, but for the memory.
pub(crate) struct Daemon {
    http: SocketAddr,
    grpc: SocketAddr,
    shutdown: Option<oneshot::Sender<()>>,
    ended: JoinHandle<Result<(), ServerError>>,
    runtime: Option<Runtime>,
}

/// An address that was taken, so that its protocol takes a free port instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Taken {
    /// `http` or `grpc`.
    pub(crate) protocol: &'static str,
    pub(crate) address: SocketAddr,
}

impl Daemon {
    /// Starts one on free ports, with maps in memory alone.
    pub(crate) async fn start_in_memory() -> Result<Self, FleetError> {
        let mut config = Config { data_dir: "".into(), ..Config::default() };
        config.http.listen.set_port(0);
        config.grpc.listen.set_port(0);
        Self::start(config, |_| None).await
    }

    /// Starts one. Where an address is taken, `instead` says where to listen; none ends it.
    pub(crate) async fn start(
        config: Config,
        instead: impl FnMut(Taken) -> Option<SocketAddr> + Send + 'static,
    ) -> Result<Self, FleetError> {
        let runtime = Runtime::new()
            .map_err(|error| FleetError::failed(format!("no thread can be started: {error}")))?;
        // Bound there as well, so that sockets wake the server's own threads.
        let server = runtime.spawn(bind(config, instead)).await.map_err(FleetError::failed)??;
        let (http, grpc) = (server.http_address(), server.grpc_address());
        let (shutdown, told) = oneshot::channel();
        let ended = runtime.spawn(server.run(async {
            // The sender gone is as good a reason to stop.
            let _ = told.await;
        }));
        Ok(Self { http, grpc, shutdown: Some(shutdown), ended, runtime: Some(runtime) })
    }

    /// Where HTTP is served.
    pub(crate) fn http(&self) -> SocketAddr {
        self.http
    }

    /// Where gRPC is served.
    pub(crate) fn grpc(&self) -> SocketAddr {
        self.grpc
    }

    /// Lets it finish what it has in hand, save, and go.
    pub(crate) async fn stop(mut self) -> Result<(), FleetError> {
        self.shutdown = None;
        Ok((&mut self.ended).await.map_err(FleetError::failed)??)
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

async fn bind(
    mut config: Config,
    mut instead: impl FnMut(Taken) -> Option<SocketAddr>,
) -> Result<Server, ServerError> {
    loop {
        let error = match Server::bind(config.clone()).await {
            Ok(server) => return Ok(server),
            Err(error) => error,
        };
        let ServerError::Listen { protocol, address, error: cause } = &error else { return Err(error) };
        let listen = match (*protocol, cause.kind()) {
            (protocol, ErrorKind::AddrInUse) => instead(Taken { protocol, address: *address }),
            _ => None,
        };
        let Some(listen) = listen else { return Err(error) };
        match *protocol {
            "http" => config.http.listen = listen,
            _ => config.grpc.listen = listen,
        }
    }
}
