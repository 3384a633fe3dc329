//! The daemon: its sockets, and going down within a bound.

mod accepting;
mod answer_body;
mod connection;
mod endpoint;
mod entrance;
mod error;
mod expiry;
mod files;
mod gauges;
mod handshakes;
mod housekeeping;
mod open_files;
mod places;
mod protocol;
mod signal;
mod socket;
mod starting;
mod stream;
mod tls;
mod watch;

pub use error::ServerError;
pub use files::ReloadedFiles;
pub use signal::{exit_when_told, reload_on_hangup, shutdown_signal};
pub use tls::TlsError;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use tokio::task::{JoinError, JoinSet};
use tokio::time::timeout;

use crate::access::{Access, Gate};
use crate::admission::Admission;
use crate::config::Config;
use crate::lifecycle::Lifecycle;
use crate::service::{Gauges, MapService, ServiceSettings};
use crate::store::OpeningProgress;
use crate::telemetry::{MeteredService, Metrics};
use crate::{grpc, http};
use accepting::{Accepting, TcpSocket};
use endpoint::Endpoint;
use files::Warnings;
use gauges::SystemGauges;
use housekeeping::keep_house;
use protocol::Protocol;
use socket::UnixSocket;
use starting::Starting;
use tls::Tls;
use watch::{measure, watch};

/// How long connections have to close once their requests are done: what is left then is idle or half open.
const CLOSING_MAX: Duration = Duration::from_secs(1);

/// A server that is bound to its addresses and not yet answering.
#[derive(Debug)]
pub struct Server {
    config: Config,
    access: Access,
    tls: Option<Tls>,
    service: MeteredService,
    lifecycle: Lifecycle,
    http: TcpSocket,
    grpc: TcpSocket,
    http_socket: Option<UnixSocket>,
    grpc_socket: Option<UnixSocket>,
}

impl Server {
    /// Binds both addresses and opens the maps. Meanwhile HTTP says at `/readyz` how far that has come. Unix sockets
    /// are made when that is done.
    ///
    /// # Errors
    /// When a map, the keys or a certificate cannot be read, an address is taken, or a socket cannot be made; where there are no keys
    /// and an address can be reached from elsewhere, unless the settings allow that.
    pub async fn bind(config: Config) -> Result<Self, ServerError> {
        let gauges = SystemGauges { data_dir: config.service_settings().data_dir };
        Self::bind_with(config, Arc::new(gauges)).await
    }

    /// [`Server::bind`], with other gauges of disk and memory than the system's.
    ///
    /// # Errors
    /// As there.
    pub async fn bind_with(config: Config, gauges: Arc<dyn Gauges>) -> Result<Self, ServerError> {
        let allowed_bytes = gauges.memory().map(|memory| memory.allowed_bytes);
        let limits = open_files::within_allowed(config.limits).within_memory(allowed_bytes);
        let config = Config { limits, ..config };
        let (access, tls) = (entrance::access(&config)?, Tls::of(&config.tls)?);
        let settings = ServiceSettings { gauges: Some(gauges), ..config.service_settings() };
        let http = TcpSocket::bind(Protocol::Http, config.http.listen)?;
        let progress = Arc::new(OpeningProgress::default());
        let routes = http::starting(Arc::clone(&progress), access.clone());
        let starting = Starting::serve(&http, tls.clone(), routes, &config.limits);
        let opened = tokio::task::spawn_blocking(move || MapService::open(settings, &progress)).await;
        starting.end().await;
        let service = opened
            .map_err(|panic| ServerError::Stopped("opening the maps", panic.to_string()))?
            .map_err(ServerError::Open)?;
        Ok(Self {
            service: MeteredService::new(service, Metrics::new()?),
            access,
            tls,
            lifecycle: Lifecycle::default(),
            http,
            grpc: TcpSocket::bind(Protocol::Grpc, config.grpc.listen)?,
            http_socket: UnixSocket::bind(Protocol::Http, config.http.socket.as_deref())?,
            grpc_socket: UnixSocket::bind(Protocol::Grpc, config.grpc.socket.as_deref())?,
            config,
        })
    }

    /// Where HTTP is served.
    pub fn http_address(&self) -> SocketAddr {
        self.http.address
    }

    /// Where gRPC is served.
    pub fn grpc_address(&self) -> SocketAddr {
        self.grpc.address
    }

    /// The file of the Unix socket where HTTP is served, if there is one.
    pub fn http_socket(&self) -> Option<&Path> {
        self.http_socket.as_ref().map(|socket| socket.file.path())
    }

    /// The file of the Unix socket where gRPC is served, if there is one.
    pub fn grpc_socket(&self) -> Option<&Path> {
        self.grpc_socket.as_ref().map(|socket| socket.file.path())
    }

    /// True where TCP connections are secured.
    pub fn is_secured(&self) -> bool {
        self.tls.is_some()
    }

    /// The files that are read again while it runs.
    pub fn files(&self) -> ReloadedFiles {
        let warnings = Warnings {
            keys: self.config.access.expiry_warning(),
            certificates: self.config.tls.expiry_warning(),
        };
        ReloadedFiles::new(self.access.clone(), self.tls.clone(), self.service.metrics().clone(), warnings)
    }

    /// Serves until `shutdown`, then goes down: refuses what is new, waits `drain_seconds` at most for what is in
    /// flight, saves the maps.
    ///
    /// Idle and half-open connections do not keep it from going down: after their requests connections have
    /// a second to close. HTTP takes connections while requests are in flight, so that `/readyz` tells.
    ///
    /// # Errors
    /// When a listener stops by itself, or the maps cannot be saved at the end.
    pub async fn run(self, shutdown: impl Future<Output = ()>) -> Result<(), ServerError> {
        let Self { config, access, tls, service, lifecycle, .. } = &self;
        let bytes_max = config.limits.message_bytes_max;
        let gate = Gate::new(access.clone(), service.clone());
        let admission = Admission::new(&config.limits.admission(), lifecycle.clone());
        let (routes, health) = grpc::routes(gate.clone(), admission.clone(), bytes_max)?;
        let router = http::router(gate, admission.clone(), bytes_max);
        let grpc = Endpoint::new(Protocol::Grpc, routes.into_axum_router(), tls.clone(), &config.limits);
        let http = Endpoint::new(Protocol::Http, router, tls.clone(), &config.limits);

        let (config, service, lifecycle) = (config.clone(), service.clone(), lifecycle.clone());
        let files = self.files();
        measure(&service).await;
        let mut accepting = self.accept(&grpc, &http);
        let watching = tokio::spawn(watch(service.clone(), admission));
        let looking = tokio::spawn(files.look_after(lifecycle.clone()));
        let housekeeping = tokio::spawn(keep_house(service.clone(), lifecycle.clone()));
        health.set_serving().await;

        let ended = tokio::select! {
            () = shutdown => Ok(()),
            stopped = accepting.join_next() => stopped.map_or(Ok(()), |end| Err(stopped_by_itself(end))),
        };

        tracing::info!(drain_seconds = config.drain_seconds, "draining");
        health.set_not_serving().await;
        lifecycle.drain();
        grpc.close();
        if timeout(config.drain(), lifecycle.idle()).await.is_err() {
            tracing::warn!(drain_seconds = config.drain_seconds, "requests in flight are cut");
        }
        lifecycle.cut();
        http.close();
        if timeout(CLOSING_MAX, async { tokio::join!(grpc.closed(), http.closed()) }).await.is_err() {
            grpc.cut();
            http.cut();
        }
        // It ends by itself when draining begins; waiting keeps its last saving apart from the one below.
        let _ended = tokio::join!(housekeeping, watching);
        // A file system that hangs does not keep the server from ending.
        looking.abort();
        let maps = service.maps().save().await.map_err(ServerError::Save)?;
        tracing::info!(maps, "saved, ending");
        ended
    }

    /// Takes connections from now on, at every socket.
    fn accept(self, grpc: &Endpoint, http: &Endpoint) -> JoinSet<()> {
        tracing::info!(http = %self.http.address, grpc = %self.grpc.address, "serving");
        let mut accepting = JoinSet::new();
        for (endpoint, tcp, unix) in
            [(grpc, self.grpc, self.grpc_socket), (http, self.http, self.http_socket)]
        {
            accepting.spawn(endpoint.clone().accept(Accepting::Tcp(tcp.listener)));
            if let Some(socket) = unix {
                tracing::info!(protocol = endpoint.protocol.as_str(), socket = %socket.file.path().display(), "serving");
                accepting.spawn(endpoint.clone().accept(Accepting::Unix(socket)));
            }
        }
        accepting
    }
}

fn stopped_by_itself(end: Result<(), JoinError>) -> ServerError {
    let why = end.map_or_else(|panic| panic.to_string(), |()| "without a reason".into());
    ServerError::Stopped("a listener", why)
}
