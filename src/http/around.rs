//! What happens around every request: its operation, its span, the refusal while draining, its count.

use std::time::Instant;

use axum::extract::{MatchedPath, Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tower_http::request_id::RequestId;
use tracing::Instrument;

use super::Adapter;
use super::error::{self, HttpError};
use crate::access::Operation;

pub(super) async fn request(State(adapter): State<Adapter>, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let operation = operation(&request);
    // Whatever a client may send, it is one of few.
    let name = operation.as_ref().map_or("unknown", |operation| operation.name());
    let id = request.extensions().get::<RequestId>().and_then(|id| id.header_value().to_str().ok());
    let span = tracing::info_span!("http", operation = name, request_id = id);
    let response = match operation {
        Ok(operation) => admitted(&adapter, operation, next.run(request)).instrument(span).await,
        Err(none) => none.into_response(),
    };
    let (status, elapsed) = (response.status(), start.elapsed());
    adapter.service.metrics().request("http", name, status.as_str().to_owned(), elapsed);
    tracing::debug!(operation = name, status = status.as_u16(), ?elapsed, "http request");
    response
}

async fn admitted(
    adapter: &Adapter,
    operation: Operation,
    answer: impl Future<Output = Response>,
) -> Response {
    if operation.is_probe() {
        return answer.await;
    }
    adapter.lifecycle.admit(answer).await.unwrap_or_else(|refusal| HttpError::from(refusal).into_response())
}

/// What the request asks for, or the answer where that is nothing there is.
fn operation(request: &Request) -> Result<Operation, HttpError> {
    let Some(route) = request.extensions().get::<MatchedPath>() else {
        return Err(error::no_such_route(request));
    };
    let operation = Operation::of_request(request.method().as_str(), route.as_str());
    operation.ok_or_else(|| error::no_such_method(request, route.as_str()))
}
