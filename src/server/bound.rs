//! A server that is bound to its addresses: it answers, and goes down within a bound.

use super::error::ServerError;
use super::files::ReloadableFiles;
use std::net::SocketAddr;
use std::path::Path;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::task::{JoinError, JoinSet};
use tokio::time::{sleep, timeout};

use super::background::keep_house;
use super::endpoint::Endpoint;
use super::files::Warnings;
use super::listener::{Accepting, TcpSocket};
use super::membership::Membership;
use super::opening::{Opening, Wanted, panicked};
use super::protocol::Protocol;
use super::socket::UnixSocket;
use super::starting::{CLOSING_MAX, Starting};
use super::system_readings::SystemGauges;
use super::tls::Tls;
use super::watch::{measure, watch};
use super::{access_policy, rlimit};
use crate::access::{Access, Gate};
use crate::admission::{Admission, Lifecycle};
use crate::config::Config;
use crate::middleware::Middleware;
use crate::telemetry::{Audit, Metrics, RequestRecorder};
use crate::{grpc, http};
use mrol_service::{Gauges, Limits, MapService, Observer, ServiceSettings};

/// The least time for saving the maps at the end: also who waits for no request wants them saved.
const SAVING_MIN: Duration = Duration::from_secs(5);

/// Connections of the listener for health and metrics: monitors are few, and each file that they may open is one less
/// for robots.
const ADMIN_CONNECTIONS_MAX: usize = 64;
/// Connections of it besides, where all of those are in use.
const ADMIN_CONNECTIONS_RESERVED: usize = 16;

/// How long the end of the process may take once everything has been waited for.
const ENDING_MAX: Duration = Duration::from_secs(5);

/// A server that is bound to its addresses and not yet answering.
#[derive(Debug)]
pub struct Server {
    config: Config,
    access: Access,
    tls: Option<Tls>,
    service: MapService,
    membership: Membership,
    recorder: RequestRecorder,
    lifecycle: Lifecycle,
    http: TcpSocket,
    grpc: TcpSocket,
    admin: Option<TcpSocket>,
    http_socket: Option<UnixSocket>,
    grpc_socket: Option<UnixSocket>,
    wanted: Wanted,
}

impl Server {
    /// Binds both addresses and finds the maps, which [`Server::run`] opens. Maps in files of old are taken in first:
    /// meanwhile HTTP says at `/readyz` how far that has come. Unix sockets are made when that is done. Dropped before,
    /// it stops.
    ///
    /// # Errors
    /// When the data folder, the keys or a certificate cannot be read, an address is taken, or a socket cannot be made;
    /// where there are no keys and an address can be reached from elsewhere, unless the settings allow that.
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
        let limits = rlimit::within_allowed(config.limits).within_memory(allowed_bytes);
        let config = Config { limits, ..config };
        let (access, tls) = (access_policy::access(&config)?, Tls::of(&config.tls)?);
        let (metrics, audit) = (Metrics::new()?, Audit::default());
        let observers: Vec<Arc<dyn Observer>> = vec![Arc::new(metrics.clone()), Arc::new(audit.clone())];
        let settings = ServiceSettings { gauges: Some(gauges), observers, ..config.service_settings() };
        let http = TcpSocket::bind(Protocol::Http, config.http.listen)?;
        // That of gRPC too, since a node tells the others where it is.
        let grpc = TcpSocket::bind(Protocol::Grpc, config.grpc.listen)?;
        let (membership, access) = Membership::of(&config, (http.address, grpc.address), access)?;
        let settings = ServiceSettings { cluster: membership.cluster(), ..settings };
        let wanted = Wanted::default();
        tracing::info!(http = %http.address, data_dir = ?settings.data_dir, "opening the maps");
        let admin =
            config.admin.listen.map(|address| TcpSocket::bind(Protocol::Admin, address)).transpose()?;
        let start = |protocol, socket: &TcpSocket, routes, limits: &Limits| {
            Starting::serve(protocol, socket, tls.clone(), routes, limits, metrics.clone())
        };
        let routes = http::starting(wanted.progress().clone(), access.clone());
        let starting = start(Protocol::Http, &http, routes, &config.limits);
        let admin_starting = admin.as_ref().map(|socket| {
            let routes = http::admin_starting(wanted.progress().clone(), access.clone());
            start(Protocol::Admin, socket, routes, &admin_limits(&config.limits))
        });
        let begin = {
            let progress = wanted.progress().clone();
            move || MapService::begin(settings, &progress)
        };
        let begun = tokio::task::spawn_blocking(begin).await;
        starting.end().await;
        if let Some(starting) = admin_starting {
            starting.end().await;
        }
        let service = begun.map_err(|panic| panicked(&panic))?.map_err(ServerError::Open)?;
        Ok(Self {
            service,
            membership,
            recorder: RequestRecorder::new(metrics, audit),
            access,
            tls,
            lifecycle: Lifecycle::default(),
            http,
            admin,
            grpc,
            http_socket: UnixSocket::bind(Protocol::Http, config.http.socket.as_deref())?,
            grpc_socket: UnixSocket::bind(Protocol::Grpc, config.grpc.socket.as_deref())?,
            wanted,
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

    /// Where health and metrics are served by themselves, if they are.
    pub fn admin_address(&self) -> Option<SocketAddr> {
        self.admin.as_ref().map(|socket| socket.address)
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
    pub fn files(&self) -> ReloadableFiles {
        let warnings = Warnings {
            keys: self.config.access.expiry_warning(),
            certificates: self.config.tls.expiry_warning(),
        };
        ReloadableFiles::new(self.access.clone(), self.tls.clone(), self.recorder.metrics().clone(), warnings)
    }

    /// The time after which a server that was told to end is down, or has failed to be: the delay before draining, what
    /// is in flight, its maps that other nodes take over, its connections, saving, and a while for what comes after.
    pub fn down_within(&self) -> Duration {
        let config = &self.config;
        let waited = config.drain_delay().saturating_add(config.drain()).saturating_add(saving_max(config));
        waited.saturating_add(Membership::LEAVING_MAX + CLOSING_MAX + ENDING_MAX)
    }

    /// Opens the maps, and serves each as soon as it is open, until `shutdown`. Then it goes down: says for
    /// `drain_delay_s` that it is not ready, refuses what is new, waits `drain_seconds` at most for what is in flight,
    /// and as long at most, or five seconds, for the maps to be saved.
    ///
    /// Idle and half-open connections do not keep it from going down: after their requests connections have
    /// a second to close. HTTP takes connections while requests are in flight, so that `/readyz` tells.
    ///
    /// # Errors
    /// When a listener stops by itself, the maps cannot be opened, or they cannot be saved at the end, or not in time:
    /// a disk may hang. A thread of the runtime is then in its hands, so that the runtime has to be left behind
    /// ([`tokio::runtime::Runtime::shutdown_background`]).
    pub async fn run(self, shutdown: impl Future<Output = ()>) -> Result<(), ServerError> {
        let files = self.files();
        let Self { config, access, tls, service, membership, recorder, lifecycle, wanted, .. } = self;
        let (http_tcp, http_unix, grpc_tcp, grpc_unix) =
            (self.http, self.http_socket, self.grpc, self.grpc_socket);
        let admin_tcp = self.admin;
        let metrics = recorder.metrics().clone();
        let bytes_max = config.limits.message_bytes_max;
        let gate = Gate::new(access.clone(), service.clone());
        let admission = Admission::new(&config.limits, lifecycle.clone());
        let middleware = Middleware::new(gate.clone(), admission.clone(), recorder.clone());
        let (routes, health) = grpc::routes(&middleware, bytes_max)?;
        let router = http::router(&middleware, bytes_max);
        let endpoint = |protocol, router, limits: &Limits| {
            Endpoint::new(protocol, router, tls.clone(), limits, metrics.clone())
        };
        let grpc = endpoint(Protocol::Grpc, routes.into_axum_router(), &config.limits);
        let http = endpoint(Protocol::Http, router, &config.limits);
        let admin = {
            let limits = admin_limits(&config.limits);
            // With places of its own, so that what fills the main ports does not keep its monitors out.
            let admission = Admission::new(&limits, lifecycle.clone());
            let middleware = Middleware::new(gate, admission, recorder.clone());
            endpoint(Protocol::Admin, http::admin_router(&middleware, bytes_max), &limits)
        };

        let mut shutdown = pin!(shutdown);
        tokio::select! {
            () = measure(&service, &metrics) => {}
            () = &mut shutdown => {
                tracing::info!("told to end before it served: ends");
                return Ok(());
            }
        }
        membership.begin(&service, &lifecycle);
        let mut opening = Opening::begin(service.clone(), wanted, health, &lifecycle).await;
        tracing::info!(http = %http_tcp.address, grpc = %grpc_tcp.address, "serving");
        let admin_sockets = admin_tcp.map(|tcp| (&admin, tcp, None));
        let sockets = [(&grpc, grpc_tcp, grpc_unix), (&http, http_tcp, http_unix)];
        let mut accepting = accept(sockets.into_iter().chain(admin_sockets));
        let watching = tokio::spawn(watch(service.clone(), metrics.clone(), admission, membership.clone()));
        let looking = tokio::spawn(files.look_after(lifecycle.clone()));
        let housekeeping = tokio::spawn(keep_house(service.clone(), metrics, lifecycle.clone()));

        let ended = tokio::select! {
            () = &mut shutdown => Ok(()),
            stopped = accepting.join_next() => stopped.map_or(Ok(()), |end| Err(stopped_by_itself(end))),
            error = opening.failed() => Err(error),
        };

        lifecycle.leave();
        opening.end().await;
        // What comes from now on goes on to those that take over.
        membership.leave(&service).await;
        if ended.is_ok() && config.drain_delay_s > 0 {
            tracing::info!(
                drain_delay_s = config.drain_delay_s,
                "told to end: not ready any more, and serving on"
            );
            sleep(config.drain_delay()).await;
        }
        tracing::info!(drain_seconds = config.drain_seconds, "draining");
        lifecycle.drain();
        grpc.close();
        if timeout(config.drain(), lifecycle.idle()).await.is_err() {
            tracing::warn!(drain_seconds = config.drain_seconds, "requests in flight are cut");
        }
        lifecycle.cut();
        http.close();
        admin.close();
        let closed = async { tokio::join!(grpc.closed(), http.closed(), admin.closed()) };
        if timeout(CLOSING_MAX, closed).await.is_err() {
            [grpc, http, admin].iter().for_each(Endpoint::cut);
        }
        // A file system that hangs does not keep the server from ending.
        looking.abort();
        let saving = async {
            // They end by themselves when draining begins; waiting keeps the last saving of the one apart from this.
            let _ended = tokio::join!(housekeeping, watching, membership.end());
            service.save().await
        };
        let most = saving_max(&config);
        let saved = timeout(most, saving).await;
        let maps = saved.map_err(|_| ServerError::SavingTooLong(most))?.map_err(ServerError::Save)?;
        tracing::info!(maps, "saved, ending");
        ended
    }
}

/// Takes connections from now on, at every socket.
fn accept<'a>(sockets: impl Iterator<Item = (&'a Endpoint, TcpSocket, Option<UnixSocket>)>) -> JoinSet<()> {
    let mut accepting = JoinSet::new();
    for (endpoint, tcp, unix) in sockets {
        accepting.spawn(endpoint.clone().accept(Accepting::Tcp(tcp.listener)));
        if let Some(socket) = unix {
            tracing::info!(protocol = endpoint.protocol.as_str(), socket = %socket.file.path().display(), "serving");
            accepting.spawn(endpoint.clone().accept(Accepting::Unix(socket)));
        }
    }
    accepting
}

/// The limits of the listener for health and metrics: few connections, since few ask.
fn admin_limits(limits: &Limits) -> Limits {
    Limits {
        connections_max: limits.connections_max.min(ADMIN_CONNECTIONS_MAX),
        connections_reserved: limits.connections_reserved.min(ADMIN_CONNECTIONS_RESERVED),
        ..limits.clone()
    }
}

/// How long saving the maps may take when the server goes down.
fn saving_max(config: &Config) -> Duration {
    config.drain().max(SAVING_MIN)
}

fn stopped_by_itself(end: Result<(), JoinError>) -> ServerError {
    let why = end.map_or_else(|panic| panic.to_string(), |()| "without a reason".into());
    ServerError::Stopped("a listener", why)
}
