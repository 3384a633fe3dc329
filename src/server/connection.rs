//! One connection, from its first byte to its last.

use std::convert::Infallible;
use std::fmt::Display;
use std::pin::pin;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{Request, Response};
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::TokioIo;
use tokio::time::{sleep, timeout};
use tokio_rustls::TlsAcceptor;
use tower::ServiceExt;

use super::connection_slots::ConnectionSlot;
use super::endpoint::Endpoint;
use super::listener::Accepted;
use super::starting::CLOSING_MAX;
use super::stream::{Count, Counted, secure};
use super::tracked_body::TrackedBody;
use crate::access::Peer;
use crate::admission::CloseConnection;
use mrol_map::sync::polled_by_runtime;

/// How long a client may leave unread what it asked for.
const UNREAD_MAX: Duration = Duration::from_secs(30);

impl Endpoint {
    /// Serves a connection until its client closes it or leaves answers unread, it has been idle for too long, another
    /// gets its place, or the server is going down.
    pub(super) async fn serve(self, stream: Accepted, tls: Option<TlsAcceptor>, place: ConnectionSlot) {
        tokio::select! {
            () = polled_by_runtime(self.serve_open(stream, tls, &place)) => {}
            () = place.lost() => {}
            () = place.unread_for(UNREAD_MAX) => {}
            () = sleep(self.bounds.reserved_max), if place.is_reserved() => {}
            () = self.cut.cancelled() => {}
        }
    }

    async fn serve_open(&self, accepted: Accepted, tls: Option<TlsAcceptor>, place: &ConnectionSlot) {
        let Accepted { stream, peer, at } = accepted;
        let stream = match timeout(self.bounds.opening_max, secure(stream, tls)).await {
            Ok(Ok(stream)) => stream,
            Ok(Err(error)) => return self.not_secured(peer, &error),
            Err(_) => return self.not_secured(peer, &"it did not come in time"),
        };
        let (stream, bytes_read) = Counted::new(stream);
        let service = service_fn(|mut request: Request<Incoming>| {
            request.extensions_mut().insert(peer);
            at.map(|at| request.extensions_mut().insert(at));
            answer(self.router.clone(), place.clone(), request)
        });
        let mut connection = pin!(self.builder.serve_connection(TokioIo::new(stream), service));
        tokio::select! {
            _ = &mut connection => return,
            () = self.not_opened(bytes_read) => return,
            () = place.idle_for(self.bounds.idle_max) => {}
            () = self.closing.cancelled() => {}
        }
        connection.as_mut().graceful_shutdown();
        tokio::select! {
            // What goes wrong with a connection, its client sees; there is nobody else to tell.
            _ = connection => {}
            () = lingering(place) => {}
        }
    }

    /// A handshake has failed, for a reason that the client's end may not show.
    fn not_secured(&self, peer: Peer, why: &dyn Display) {
        if let Some(tls) = &self.tls {
            tls.failures().add(self.protocol, peer, why);
        }
    }

    /// Waits until it is clear that the client will never begin to speak.
    async fn not_opened(&self, bytes_read: Count) {
        sleep(self.bounds.opening_max).await;
        if bytes_read.get() >= self.protocol.opening_bytes() {
            std::future::pending().await
        }
    }
}

/// Waits until a connection that is to be closed has had the time for it, and has no request in flight.
async fn lingering(place: &ConnectionSlot) {
    sleep(CLOSING_MAX).await;
    place.idle_for(CLOSING_MAX).await;
}

/// Answers a request; until the answer is sent, the connection is in use.
async fn answer(
    router: Router,
    place: ConnectionSlot,
    mut request: Request<Incoming>,
) -> Result<Response<Body>, Infallible> {
    let used = place.used();
    request.extensions_mut().insert(CloseConnection(place.hang_up()));
    request.extensions_mut().insert(place.shared());
    let response = router.oneshot(request).await?;
    Ok(response.map(|body| Body::new(TrackedBody::new(body, used))))
}
