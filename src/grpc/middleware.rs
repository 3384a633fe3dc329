//! What happens around every call: whether its caller may ask for it, its span, its deadline, the refusal while
//! draining, its count.

use std::time::Instant;

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::HeaderMap;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use tonic::{Code, Status};
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, RequestId, SetRequestIdLayer};
use tracing::Instrument;

use super::deadline_body::DeadlineBody;
use super::decompression::{Compressed, Inflation};
use super::message_framing::WholeMessages;
use super::{deadline, not_grpc, status};
use crate::access::{Authorized, Gate, Operation, revocable};
use crate::admission::Admission;
use crate::service::{ErrorCode, ServiceError};

/// How much of an unknown path is repeated to who sent it.
const PATH_LENGTH_MAX: usize = 80;

/// What calls pass before a handler sees them.
#[derive(Debug, Clone)]
pub(super) struct Around {
    pub(super) gate: Gate,
    pub(super) admission: Admission,
    pub(super) inflation: Inflation,
    pub(super) message_bytes_max: usize,
}

impl Around {
    /// Wraps the services' routes.
    pub(super) fn wrap(self, routes: Router) -> Router {
        routes
            .layer(from_fn_with_state(self, call))
            .layer(PropagateRequestIdLayer::x_request_id())
            .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
    }

    /// Gives the call what its handler works with, if its caller may ask for it.
    fn authorized(&self, operation: Operation, call: &mut Request) -> Result<Operation, Status> {
        let authorized = self.gate.authorize(operation, call)?;
        call.extensions_mut().insert(authorized);
        Ok(operation)
    }

    async fn answer(&self, operation: Operation, mut call: Request, next: Next) -> Response {
        let authorized = call.extensions().get::<Authorized>().cloned();
        let key = authorized.as_ref().and_then(|authorized| authorized.caller.name());
        let id = call.extensions().get::<RequestId>().and_then(|id| id.header_value().to_str().ok());
        let span = tracing::info_span!("grpc", operation = operation.name(), request_id = id, key);
        if let Some(key) = key {
            self.gate.metrics().key_used("grpc", key);
        }
        let has_key = key.is_some();
        let begin = Instant::now();
        let (deadline, compressed) = (deadline::of(call.headers()), Compressed::of(call.headers()));
        call.extensions_mut().insert(compressed);
        let handle = |call: Request| {
            let call = call.map(|body| Body::new(WholeMessages::new(body, self.message_bytes_max)));
            deadline::within(deadline, self.inflation.within(compressed, next.run(call)))
        };
        let answer = self.admission.answer(operation, call, handle);
        let answer = match &authorized {
            Some(Authorized { caller, .. }) => {
                let answer = caller.while_valid(answer).instrument(span).await;
                answer.map(|response| revocable(response, caller, trailers_of))
            }
            None => answer.instrument(span).await,
        };
        let response = answer.unwrap_or_else(|refusal| Status::from(refusal).into_http());
        match Status::from_header_map(response.headers()) {
            Some(refused) => status::of_request(refused, self.message_bytes_max).into_http(),
            None => {
                let response = match deadline {
                    Some(most) => DeadlineBody::wrap(response, most, begin, deadline::reached(most)),
                    None => response,
                };
                match operation == Operation::HealthWatch && !has_key {
                    true => self.watch_for_a_while(response, begin),
                    false => response,
                }
            }
        }
    }

    /// Ends a health watch of somebody without a key after a while: places are few.
    fn watch_for_a_while(&self, response: Response, begin: Instant) -> Response {
        let most = self.admission.health_watch_max();
        let message = format!(
            "health_watch_max_s is {}: a watch without a key ends then, watch again",
            most.as_secs_f64()
        );
        let over = ServiceError::new(ErrorCode::DeadlineExceeded, "health_watch_over", message);
        DeadlineBody::wrap(response, most, begin, over)
    }
}

async fn call(State(around): State<Around>, mut request: Request, next: Next) -> Response {
    let start = Instant::now();
    if let Some(refusal) = not_grpc::refusal(&request) {
        around.gate.metrics().request(
            "grpc",
            "unknown",
            refusal.status().as_str().to_owned(),
            start.elapsed(),
        );
        return refusal;
    }
    let operation = Operation::of_call(request.uri().path());
    // Whatever a client may send, it is one of few.
    let name = operation.map_or("unknown", Operation::name);
    let authorized = operation.ok_or_else(|| no_such_call(&request));
    let response = match authorized.and_then(|operation| around.authorized(operation, &mut request)) {
        Ok(operation) => around.answer(operation, request, next).await,
        Err(refusal) => refusal.into_http(),
    };
    let code = code(&response);
    let reason = response.headers().get(status::REASON).map(|reason| reason.as_bytes());
    status::count_denial(around.gate.metrics(), code, reason);
    if code != Code::Ok || !operation.is_some_and(answers_message_by_message) {
        around.gate.metrics().request("grpc", name, status::label(code), start.elapsed());
    }
    tracing::debug!(operation = name, code = status::label(code), elapsed = ?start.elapsed(), "grpc call");
    response
}

/// The status of a call that failed after a part of its answer was sent.
fn trailers_of(error: ServiceError) -> Option<HeaderMap> {
    let mut trailers = HeaderMap::new();
    // Without a status the client takes the call for cut, which it is.
    let _ = Status::from(error).add_header(&mut trailers);
    Some(trailers)
}

/// True for calls whose requests are counted one by one where they are answered, and not here.
fn answers_message_by_message(operation: Operation) -> bool {
    matches!(operation, Operation::QueryPointsStream | Operation::InsertScanStream)
}

fn no_such_call(request: &Request) -> Status {
    let path: String = request.uri().path().chars().take(PATH_LENGTH_MAX).collect();
    Status::unimplemented(format!("no call {path}"))
}

/// The code of a call that failed; one that did not has none in its headers.
fn code(response: &Response) -> Code {
    response.headers().get("grpc-status").map_or(Code::Ok, |value| Code::from_bytes(value.as_bytes()))
}
