//! A protocol at its sockets: connections come, are served side by side, and go.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;

use hyper_util::server::conn::auto::Builder;
use tokio::task::yield_now;
use tokio_rustls::TlsAcceptor;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use super::connection_slots::ConnectionSlots;
use super::listener::Accepting;
use super::protocol::{Protocol, RuntimeExecutor};
use super::tls::Tls;
use crate::telemetry::Metrics;
use mrol_service::Limits;

/// A protocol with its connections, whatever sockets they come from. A clone is another handle on the same ones.
///
/// ```text
/// accepting --close()--> no more connections; each ends with the requests that it has in flight
///           --cut()----> each ends now
/// ```
#[derive(Debug, Clone)]
pub(super) struct Endpoint {
    pub(super) protocol: Protocol,
    pub(super) router: Router,
    pub(super) bounds: Bounds,
    pub(super) builder: Arc<Builder<RuntimeExecutor>>,
    pub(super) closing: CancellationToken,
    pub(super) cut: CancellationToken,
    metrics: Metrics,
    pub(super) tls: Option<Tls>,
    places: ConnectionSlots,
    tasks: TaskTracker,
}

/// What a connection may take of the server's patience.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Until it is secure and has begun to speak.
    pub(super) opening_max: Duration,
    /// How long a connection may stay without a request.
    pub(super) idle_max: Duration,
    /// In all, where it was taken for a health check while all places were in use.
    pub(super) reserved_max: Duration,
}

impl Endpoint {
    pub(super) fn new(
        protocol: Protocol,
        router: Router,
        tls: Option<Tls>,
        limits: &Limits,
        metrics: Metrics,
    ) -> Self {
        let opening_max = Duration::from_secs_f64(limits.connection_opening_max_s);
        let reserved_max = Duration::from_secs_f64(limits.probe_time_max_s);
        Self {
            protocol,
            router,
            bounds: Bounds { opening_max, idle_max: protocol.idle_max(limits), reserved_max },
            builder: protocol.builder(limits).into(),
            closing: CancellationToken::new(),
            cut: CancellationToken::new(),
            metrics,
            tls,
            places: ConnectionSlots::new(limits.connections_max, limits.connections_reserved),
            tasks: TaskTracker::new(),
        }
    }

    /// Takes connections of `sockets` until told to close. One for which there is no place is closed at once: that
    /// tells its client more than silence would.
    pub(super) async fn accept(self, sockets: Accepting) {
        let listener = self.listener(&sockets);
        loop {
            let stream = tokio::select! {
                biased;
                () = self.closing.cancelled() => return,
                stream = sockets.next() => stream,
            };
            match self.places.take(stream.peer) {
                Some(place) => {
                    let (tls, is_reserved) = (self.tls_at(&sockets), place.is_reserved());
                    let open = self.metrics.connection_opened(listener);
                    let serving = self.clone().serve(stream, tls, place);
                    self.tasks.spawn(async move {
                        serving.await;
                        drop(open);
                    });
                    if is_reserved {
                        // What came is looked at before the next that may take its place.
                        yield_now().await;
                    }
                }
                None => {
                    self.metrics.connection_refused(listener);
                    tracing::warn!(
                        protocol = self.protocol.as_str(),
                        "connections_max are in use: another is closed"
                    );
                }
            }
        }
    }

    /// What connections of `sockets` are counted as.
    fn listener(&self, sockets: &Accepting) -> &'static str {
        match (self.protocol, sockets) {
            (Protocol::Http, Accepting::Tcp(_)) => "http",
            (Protocol::Http, Accepting::Unix(_)) => "http_socket",
            (Protocol::Grpc, Accepting::Tcp(_)) => "grpc",
            (Protocol::Grpc, Accepting::Unix(_)) => "grpc_socket",
            (Protocol::Admin, _) => "admin",
        }
    }

    /// What a new connection is secured with: none of the same machine is.
    fn tls_at(&self, sockets: &Accepting) -> Option<TlsAcceptor> {
        let tls = self.tls.as_ref().filter(|_| matches!(sockets, Accepting::Tcp(_)));
        tls.map(|tls| tls.acceptor(self.protocol))
    }

    pub(super) fn close(&self) {
        self.closing.cancel();
        self.tasks.close();
    }

    pub(super) fn cut(&self) {
        self.cut.cancel();
    }

    /// Waits until the last connection is closed.
    pub(super) async fn closed(&self) {
        self.tasks.wait().await;
    }
}
