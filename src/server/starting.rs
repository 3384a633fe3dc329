//! HTTP while the maps are being found, and those in files of old taken in: the same socket, and answers of its own.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use tokio::task::JoinHandle;
use tokio::time::timeout;

use super::endpoint::Endpoint;
use super::listener::{Accepting, TcpSocket};
use super::protocol::Protocol;
use super::tls::Tls;
use crate::telemetry::Metrics;
use mrol_service::Limits;

/// How long connections have to close once their requests are done: what is left then is idle or half open.
pub(super) const CLOSING_MAX: Duration = Duration::from_secs(1);

/// Answers until the maps are found.
pub(super) struct Starting {
    endpoint: Endpoint,
    accepting: JoinHandle<()>,
}

impl Starting {
    /// Begins to answer at `socket`.
    pub(super) fn serve(
        protocol: Protocol,
        socket: &TcpSocket,
        tls: Option<Tls>,
        routes: Router,
        limits: &Limits,
        metrics: Metrics,
    ) -> Self {
        let endpoint = Endpoint::new(protocol, routes, tls, limits, metrics);
        let socket = Accepting::Tcp(Arc::clone(&socket.listener));
        let accepting = tokio::spawn(endpoint.clone().accept(socket));
        Self { endpoint, accepting }
    }

    /// Answers what was asked, and leaves the socket to the server.
    pub(super) async fn end(self) {
        self.endpoint.close();
        // It cannot fail, and where it did, the server's own takes its place.
        let _ended = self.accepting.await;
        if timeout(CLOSING_MAX, self.endpoint.closed()).await.is_err() {
            self.endpoint.cut();
        }
    }
}
