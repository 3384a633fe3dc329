//! The daemon: both listeners, periodic saving, and going down within a bound.

mod socket;
mod starting;

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use axum::serve::ListenerExt;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_stream::Stream;
use tokio_stream::wrappers::UnixListenerStream;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use tonic::transport::server::{Connected, TcpIncoming};

use crate::config::Config;
use crate::lifecycle::Lifecycle;
use crate::service::{MapService, ServiceError};
use crate::store::OpeningProgress;
use crate::telemetry::{MeteredService, Metrics, TelemetryError};
use crate::wire::transport;
use crate::{grpc, http};
use socket::UnixSocket;
use starting::Starting;

/// Streams of one gRPC connection at once: with the size of a message it bounds what a client may hold.
const STREAMS_PER_CONNECTION_MAX: u32 = 128;
/// How long connections have to close once their requests are done: what is left then is idle or half open.
const CLOSING_MAX: Duration = Duration::from_secs(1);
/// How often it is asked whether a snapshot is due.
const SNAPSHOTS_DUE_INTERVAL: Duration = Duration::from_millis(250);
/// How often histograms are folded between scrapes.
const METRICS_UPKEEP_INTERVAL: Duration = Duration::from_secs(5);

/// Why the server could not start, or stopped.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The maps cannot be opened.
    #[error("the maps cannot be opened: {0}")]
    Open(ServiceError),
    /// An address cannot be listened on.
    #[error("{protocol} cannot listen on {address}: {error}")]
    Listen {
        /// `http` or `grpc`.
        protocol: &'static str,
        /// The address.
        address: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// A Unix socket cannot be listened on.
    #[error("{protocol} cannot listen on {}: {error}", path.display())]
    Socket {
        /// `http` or `grpc`.
        protocol: &'static str,
        /// The socket's file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Log or metrics.
    #[error(transparent)]
    Telemetry(#[from] TelemetryError),
    /// The contract that was compiled in is broken.
    #[error("reflection: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
    /// A listener stopped by itself.
    #[error("{0} stopped: {1}")]
    Stopped(&'static str, String),
    /// The maps could not be written at the end.
    #[error("the maps cannot be saved: {0}")]
    Save(ServiceError),
}

/// A server that is bound to its addresses and not yet answering.
#[derive(Debug)]
pub struct Server {
    config: Config,
    service: MeteredService,
    lifecycle: Lifecycle,
    http: Listener,
    grpc: Listener,
    http_socket: Option<UnixSocket>,
    grpc_socket: Option<UnixSocket>,
}

#[derive(Debug)]
struct Listener {
    tcp: TcpListener,
    address: SocketAddr,
}

impl Server {
    /// Binds both addresses and opens the maps. Meanwhile HTTP says at `/readyz` how far that has come. Unix sockets
    /// are made when that is done.
    ///
    /// # Errors
    /// When a map cannot be read, an address is taken, or a socket cannot be made.
    pub async fn bind(config: Config) -> Result<Self, ServerError> {
        let settings = config.service_settings();
        let http = Listener::bind("http", config.http.listen).await?;
        let progress = Arc::new(OpeningProgress::default());
        let (http, starting) = Starting::serve(http, Arc::clone(&progress))?;
        let opened = tokio::task::spawn_blocking(move || MapService::open(settings, &progress)).await;
        starting.end().await;
        let service = opened
            .map_err(|panic| ServerError::Stopped("opening the maps", panic.to_string()))?
            .map_err(ServerError::Open)?;
        Ok(Self {
            service: MeteredService::new(service, Metrics::new()?),
            lifecycle: Lifecycle::default(),
            http,
            grpc: Listener::bind("grpc", config.grpc.listen).await?,
            http_socket: UnixSocket::bind("http", config.http.socket.as_deref())?,
            grpc_socket: UnixSocket::bind("grpc", config.grpc.socket.as_deref())?,
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

    /// Serves until `shutdown`, then goes down: refuses what is new, waits `drain_seconds` at most for what is in
    /// flight, saves the maps.
    ///
    /// Idle and half-open connections do not keep it from going down: after their requests connections have
    /// a second to close. The HTTP listener stays while requests are in flight, so that `/readyz` tells.
    ///
    /// # Errors
    /// When a listener stops by itself, or the maps cannot be saved at the end.
    pub async fn run(self, shutdown: impl Future<Output = ()>) -> Result<(), ServerError> {
        let Self { config, service, lifecycle, http, grpc, http_socket, grpc_socket } = self;
        let bytes_max = config.limits.message_bytes_max;
        let (routes, health) = grpc::routes(service.clone(), lifecycle.clone(), bytes_max)?;
        let router = http::router(service.clone(), lifecycle.clone(), bytes_max);
        tracing::info!(http = %http.address, grpc = %grpc.address, "serving");

        let idle = CancellationToken::new();
        let mut listeners = JoinSet::new();
        let mut files = Vec::new();
        if let Some(UnixSocket { listener, file }) = grpc_socket {
            tracing::info!(grpc = %file.path().display(), "serving");
            files.push(file);
            listeners.spawn(serve_grpc(UnixListenerStream::new(listener), routes.clone(), lifecycle.clone()));
        }
        if let Some(UnixSocket { listener, file }) = http_socket {
            tracing::info!(http = %file.path().display(), "serving");
            files.push(file);
            listeners.spawn(serve_http(listener, router.clone(), idle.clone()));
        }
        listeners.spawn(serve_grpc(incoming(grpc.tcp), routes, lifecycle.clone()));
        listeners.spawn(serve_http(without_delay(http.tcp), router, idle.clone()));
        let housekeeping = tokio::spawn(keep_house(service.clone(), lifecycle.clone()));
        health.set_serving().await;

        let ended = tokio::select! {
            () = shutdown => Ok(()),
            stopped = listeners.join_next() => stopped.map_or(Ok(()), |end| Err(stopped_by_itself(end))),
        };

        tracing::info!(drain_seconds = config.drain_seconds, "draining");
        health.set_not_serving().await;
        lifecycle.drain();
        if timeout(config.drain(), lifecycle.idle()).await.is_err() {
            tracing::warn!(drain_seconds = config.drain_seconds, "requests in flight are cut");
        }
        lifecycle.cut();
        idle.cancel();
        if timeout(CLOSING_MAX, closed(&mut listeners)).await.is_err() {
            listeners.shutdown().await;
        }
        // It ends by itself when draining begins; waiting keeps its last saving apart from the one below.
        let _ended = housekeeping.await;
        let maps = service.maps().save().await.map_err(ServerError::Save)?;
        tracing::info!(maps, "saved, ending");
        ended
    }
}

impl Listener {
    async fn bind(protocol: &'static str, address: SocketAddr) -> Result<Self, ServerError> {
        let listen = |error| ServerError::Listen { protocol, address, error };
        let tcp = TcpListener::bind(address).await.map_err(listen)?;
        let address = tcp.local_addr().map_err(listen)?;
        Ok(Self { tcp, address })
    }
}

type Ended = Result<(), ServerError>;

fn stopped_by_itself(end: Result<Ended, tokio::task::JoinError>) -> ServerError {
    match end {
        Ok(Ok(())) => ServerError::Stopped("a listener", "without a reason".into()),
        Ok(Err(error)) => error,
        Err(panic) => ServerError::Stopped("a listener", panic.to_string()),
    }
}

async fn closed(listeners: &mut JoinSet<Ended>) {
    while listeners.join_next().await.is_some() {}
}

fn incoming(listener: TcpListener) -> TcpIncoming {
    TcpIncoming::from(listener).with_nodelay(Some(true)).with_keepalive(Some(transport::KEEPALIVE_INTERVAL))
}

fn without_delay(listener: TcpListener) -> impl axum::serve::Listener<Addr = SocketAddr> {
    listener.tap_io(|connection| {
        // A connection that refuses is slower, not broken.
        let _ = connection.set_nodelay(true);
    })
}

/// Stops accepting when the server is draining; ends when the last connection is closed, if ever.
async fn serve_grpc<C>(
    incoming: impl Stream<Item = io::Result<C>>,
    routes: Routes,
    lifecycle: Lifecycle,
) -> Ended
where
    C: AsyncRead + AsyncWrite + Connected + Unpin + Send + 'static,
{
    tonic::transport::Server::builder()
        .initial_stream_window_size(transport::STREAM_WINDOW_BYTES)
        .initial_connection_window_size(transport::CONNECTION_WINDOW_BYTES)
        .max_frame_size(transport::FRAME_BYTES_MAX)
        .max_concurrent_streams(STREAMS_PER_CONNECTION_MAX)
        .http2_keepalive_interval(Some(transport::KEEPALIVE_INTERVAL))
        .http2_keepalive_timeout(Some(transport::KEEPALIVE_TIMEOUT))
        .add_routes(routes)
        .serve_with_incoming_shutdown(incoming, async move { lifecycle.draining().await })
        .await
        .map_err(|error| ServerError::Stopped("grpc", error.to_string()))
}

/// Stops accepting when no request is in flight any more; ends when the last connection is closed, if ever.
async fn serve_http<L>(listener: L, router: axum::Router, idle: CancellationToken) -> Ended
where
    L: axum::serve::Listener,
    L::Addr: std::fmt::Debug,
{
    axum::serve(listener, router)
        .with_graceful_shutdown(idle.cancelled_owned())
        .await
        .map_err(|error| ServerError::Stopped("http", error.to_string()))
}

/// Writes snapshots of the maps whose turn it is, and keeps the metrics small, until the server is draining.
async fn keep_house(service: MeteredService, lifecycle: Lifecycle) {
    let mut saving = interval(SNAPSHOTS_DUE_INTERVAL);
    saving.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut upkeep = interval(METRICS_UPKEEP_INTERVAL);
    loop {
        tokio::select! {
            () = lifecycle.draining() => return,
            _ = upkeep.tick() => service.metrics().upkeep(),
            _ = saving.tick() => if let Err(error) = service.maps().save_due().await {
                tracing::error!(%error, "a snapshot cannot be written");
            },
        }
    }
}

/// Waits for the process to be told to end: ctrl-c, or SIGTERM where there is one.
pub async fn shutdown_signal() {
    let interrupted = async {
        if let Err(error) = tokio::signal::ctrl_c().await {
            tracing::error!(%error, "ctrl-c cannot be heard");
            std::future::pending().await
        }
    };
    tokio::select! {
        () = interrupted => {}
        () = terminated() => {}
    }
}

#[cfg(unix)]
async fn terminated() {
    use tokio::signal::unix::{SignalKind, signal};
    match signal(SignalKind::terminate()) {
        Ok(mut signal) => {
            signal.recv().await;
        }
        Err(error) => {
            tracing::error!(%error, "sigterm cannot be heard");
            std::future::pending().await
        }
    }
}

#[cfg(not(unix))]
async fn terminated() {
    std::future::pending().await
}
