//! What surrounds every request of both protocols.

use super::protocol::Protocol;
use std::time::Instant;

use axum::Router;
use axum::extract::{Request, State};
use axum::middleware::{Next, from_fn_with_state, map_request};
use axum::response::Response;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, RequestId, SetRequestIdLayer};
use tracing::field::{Empty, display};
use tracing::{Instrument, Span, info_span};

use crate::access::{Gate, Operation, Peer};
use crate::admission::Admission;
use crate::telemetry::{REQUEST, RequestRecorder};
use mrol_service::ServiceError;

/// The name of what is no operation, in metrics and the log: whatever a client sends, it is one of few.
const UNKNOWN: &str = "unknown";

/// Characters of a request's id that the log repeats: a caller may send any.
const REQUEST_ID_LENGTH_MAX: usize = 64;

/// What requests of every protocol pass before a handler sees them. A clone is another handle on the same one.
#[derive(Debug, Clone)]
pub struct Middleware {
    gate: Gate,
    admission: Admission,
    recorder: RequestRecorder,
}

impl Middleware {
    /// Requests that `gate` lets in, within the limits of `admission`, recorded by `recorder`.
    pub fn new(gate: Gate, admission: Admission, recorder: RequestRecorder) -> Self {
        Self { gate, admission, recorder }
    }

    /// The limits that requests pass.
    pub fn admission(&self) -> &Admission {
        &self.admission
    }

    /// Where answered requests are recorded.
    pub fn recorder(&self) -> &RequestRecorder {
        &self.recorder
    }

    /// Puts this before the `routes` of a protocol.
    pub fn wrap<P: Protocol, S: Clone + Send + Sync + 'static>(
        &self,
        protocol: P,
        routes: Router<S>,
    ) -> Router<S> {
        routes
            .layer(from_fn_with_state((self.clone(), protocol), serve::<P>))
            .layer(PropagateRequestIdLayer::x_request_id())
            .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
            .layer(map_request(without_unreadable_id))
    }

    /// The handler's answer to a request, if its caller may ask for the operation and there is room for it.
    async fn answer<P: Protocol>(
        &self,
        protocol: &P,
        operation: Operation,
        mut request: Request,
        next: Next,
        begin: Instant,
    ) -> Result<Response, ServiceError> {
        let authorized = self.gate.authorize(operation, &mut request)?;
        let caller = authorized.caller.clone();
        if let Some(key) = caller.name() {
            self.recorder.metrics().key_used(P::NAME, key);
        }
        request.extensions_mut().insert(authorized);
        let mut endings = protocol.endings(&request, begin);
        if caller.has_key() {
            endings.when.push(Box::pin(caller.withdrawn()));
        }
        let handle = |request| protocol.handle(request, next);
        caller.while_valid(self.admission.answer(operation, request, endings, handle)).await
    }
}

/// The request without an id that the log could not repeat: one is made then.
async fn without_unreadable_id(mut request: Request) -> Request {
    const REQUEST_ID: &str = "x-request-id";
    let id = request.headers().get(REQUEST_ID);
    if id.is_some_and(|id| id.to_str().is_ok_and(str::is_empty) || id.to_str().is_err()) {
        request.headers_mut().remove(REQUEST_ID);
    }
    request
}

/// Serves one request.
async fn serve<P: Protocol>(
    State((middleware, protocol)): State<(Middleware, P)>,
    request: Request,
    next: Next,
) -> Response {
    let begin = Instant::now();
    let operation = protocol.operation(&request);
    let name = operation.map_or(UNKNOWN, Operation::name);
    let span = span(P::NAME, name, &request);
    let answered = async {
        let answer = match operation {
            Some(operation) => middleware.answer(&protocol, operation, request, next, begin).await,
            None => middleware.gate.check_host(&request).map(|()| protocol.no_operation(&request)),
        };
        let response = answer.unwrap_or_else(|refusal| protocol.refusal(refusal));
        let (outcome, elapsed) = (protocol.outcome(&response), begin.elapsed());
        tracing::debug!(code = %outcome.code, ?elapsed, "answered");
        // The messages of a stream are recorded one by one, by whoever answers them.
        if !(outcome.is_ok && operation.is_some_and(Operation::is_stream_of_requests)) {
            middleware.recorder.answered(P::NAME, name, outcome, elapsed);
        }
        response
    };
    answered.instrument(span).await
}

/// The span of a request, whose fields stand in every line of the log within.
fn span(protocol: &'static str, operation: &'static str, request: &Request) -> Span {
    let extensions = request.extensions();
    let request_id = extensions.get::<RequestId>().and_then(|id| id.header_value().to_str().ok());
    // Visible ASCII, so that any length is a border of characters.
    let request_id = request_id.map(|id| &id[..id.len().min(REQUEST_ID_LENGTH_MAX)]);
    let peer = extensions.get::<Peer>().map(display);
    info_span!(target: REQUEST, "request", protocol, operation, request_id, peer, node = Empty, key = Empty)
}
