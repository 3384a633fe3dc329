//! The daemon within this process, on threads of its own.

use std::io::ErrorKind;
use std::net::SocketAddr;

use tokio::runtime::Runtime;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use super::bound::Server;
use super::error::ServerError;
use crate::config::Config;

/// A daemon that runs as it would in a process of its own, except for the memory.
#[derive(Debug)]
pub struct Daemon {
    http: SocketAddr,
    grpc: SocketAddr,
    shutdown: Option<oneshot::Sender<()>>,
    ended: JoinHandle<Result<(), ServerError>>,
    runtime: Option<Runtime>,
}

/// An address that was in use, so that the protocol listens at a free port instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Taken {
    /// `http`, `grpc` or `admin`.
    pub protocol: &'static str,
    /// The address.
    pub address: SocketAddr,
}

impl Daemon {
    /// Starts a daemon on free ports, with maps in memory only.
    ///
    /// # Errors
    /// As of [`Self::start`].
    pub async fn start_in_memory() -> Result<Self, ServerError> {
        let mut config = Config { data_dir: "".into(), ..Config::default() };
        config.http.listen.set_port(0);
        config.grpc.listen.set_port(0);
        Self::start(config, |_| None).await
    }

    /// Starts a daemon. Where an address is in use, `instead` returns another one, or none to fail.
    ///
    /// # Errors
    /// When the server cannot start.
    pub async fn start(
        config: Config,
        instead: impl FnMut(Taken) -> Option<SocketAddr> + Send + 'static,
    ) -> Result<Self, ServerError> {
        let runtime = Runtime::new()
            .map_err(|error| ServerError::Runtime(format!("no thread can be started: {error}")))?;
        // Bound there as well, so that sockets wake the server's own threads.
        let server = runtime
            .spawn(bind(config, instead))
            .await
            .map_err(|error| ServerError::Runtime(error.to_string()))??;
        let (http, grpc) = (server.http_address(), server.grpc_address());
        let (shutdown, told) = oneshot::channel();
        let ended = runtime.spawn(server.run(async {
            // A dropped sender stops the daemon as well.
            let _ = told.await;
        }));
        Ok(Self { http, grpc, shutdown: Some(shutdown), ended, runtime: Some(runtime) })
    }

    /// Address of HTTP.
    pub fn http(&self) -> SocketAddr {
        self.http
    }

    /// Address of gRPC.
    pub fn grpc(&self) -> SocketAddr {
        self.grpc
    }

    /// Stops the daemon: it completes requests in flight, saves its maps and ends.
    ///
    /// # Errors
    /// When the server ended by one.
    pub async fn stop(mut self) -> Result<(), ServerError> {
        self.shutdown = None;
        (&mut self.ended).await.map_err(|error| ServerError::Runtime(error.to_string()))?
    }
}

impl Drop for Daemon {
    /// Drops the runtime in the background: it must not wait for its threads on a thread of another runtime.
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
            "admin" => config.admin.listen = Some(listen),
            _ => config.grpc.listen = listen,
        }
    }
}
