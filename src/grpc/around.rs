//! What happens around every call: its span, its deadline, the refusal while draining, its count.

use std::time::Instant;

use axum::Router;
use axum::extract::{Request, State};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use tonic::{Code, Status};
use tracing::Instrument;

use super::{Adapter, deadline, status};
use crate::access::Operation;

/// How much of an unknown path is repeated to who sent it.
const PATH_LENGTH_MAX: usize = 80;

/// Wraps the services' routes.
pub(super) fn routes(routes: Router, adapter: &Adapter) -> Router {
    routes.layer(from_fn_with_state(adapter.clone(), call))
}

async fn call(State(adapter): State<Adapter>, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let operation = Operation::of_call(request.uri().path());
    // Whatever a client may send, it is one of few.
    let name = operation.map_or("unknown", Operation::name);
    let span = tracing::info_span!("grpc", operation = name);
    let response = match operation {
        Some(operation) => admitted(&adapter, operation, request, next).instrument(span).await,
        None => no_such_call(&request).into_http(),
    };
    let code = code(&response);
    if code != Code::Ok || !operation.is_some_and(answers_message_by_message) {
        adapter.service.metrics().request("grpc", name, status::label(code), start.elapsed());
    }
    tracing::debug!(operation = name, code = status::label(code), elapsed = ?start.elapsed(), "grpc call");
    response
}

async fn admitted(adapter: &Adapter, operation: Operation, request: Request, next: Next) -> Response {
    let deadline = deadline::of(request.headers());
    let answer = deadline::within(deadline, next.run(request));
    let answer = match operation.is_probe() {
        true => answer.await,
        false => adapter.lifecycle.admit(answer).await.flatten(),
    };
    answer.unwrap_or_else(|refusal| Status::from(refusal).into_http())
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
