//! What happens around every request: whether its caller may ask for it, its span, the refusal while draining, its
//! count.

use std::time::Instant;

use axum::extract::{FromRequestParts, MatchedPath, Request, State};
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tower_http::request_id::RequestId;
use tracing::Instrument;

use super::error::{self, HttpError, Reason};
use crate::access::{Authorized, Gate, Operation, revocable};
use crate::admission::Admission;
use crate::telemetry::MeteredService;

/// What requests pass before a handler sees them.
#[derive(Debug, Clone)]
pub(super) struct Around {
    pub(super) gate: Gate,
    pub(super) admission: Admission,
}

pub(super) async fn request(State(around): State<Around>, mut request: Request, next: Next) -> Response {
    let start = Instant::now();
    let operation = around.operation(&request);
    // Whatever a client may send, it is one of few.
    let name = operation.as_ref().map_or("unknown", |operation| operation.name());
    let response = match operation.and_then(|operation| around.authorized(operation, &mut request)) {
        Ok(operation) => around.answer(operation, request, next).await,
        Err(refusal) => refusal.into_response(),
    };
    let (status, elapsed) = (response.status(), start.elapsed());
    around.gate.metrics().request("http", name, status.as_str().to_owned(), elapsed);
    if let Some(reason) = Reason::of_denial(&response) {
        around.gate.metrics().denied("http", reason);
    }
    tracing::debug!(operation = name, status = status.as_u16(), ?elapsed, "http request");
    response
}

impl Around {
    /// Gives the request what its handler works with, if its caller may ask for it.
    fn authorized(&self, operation: Operation, request: &mut Request) -> Result<Operation, HttpError> {
        let authorized = self.gate.authorize(operation, request)?;
        request.extensions_mut().insert(authorized);
        Ok(operation)
    }

    /// What the request asks for, or the answer where that is nothing there is.
    fn operation(&self, request: &Request) -> Result<Operation, HttpError> {
        let asked = operation(request);
        if asked.is_err() {
            self.gate.check_host(request)?;
        }
        asked
    }

    async fn answer(&self, operation: Operation, request: Request, next: Next) -> Response {
        let authorized = request.extensions().get::<Authorized>().cloned();
        let id = request.extensions().get::<RequestId>().and_then(|id| id.header_value().to_str().ok());
        let key = request.extensions().get::<Authorized>().and_then(|authorized| authorized.caller.name());
        let span = tracing::info_span!("http", operation = operation.name(), request_id = id, key);
        if let Some(key) = key {
            self.gate.metrics().key_used("http", key);
        }
        let handle = async |request| Ok(next.run(request).await);
        let answer = self.admission.answer(operation, request, handle);
        let answer = match &authorized {
            Some(Authorized { caller, .. }) => {
                // HTTP has no word for an answer that ends early: it is cut.
                let answer = caller.while_valid(answer).instrument(span).await;
                answer.map(|response| revocable(response, caller, |_| None))
            }
            None => answer.instrument(span).await,
        };
        answer.unwrap_or_else(|refusal| HttpError::from(refusal).into_response())
    }
}

/// What the request asks for, or the answer where that is nothing there is.
fn operation(request: &Request) -> Result<Operation, HttpError> {
    let Some(route) = request.extensions().get::<MatchedPath>() else {
        return Err(error::no_such_route(request));
    };
    let operation = Operation::of_request(request.method().as_str(), route.as_str());
    operation.ok_or_else(|| error::no_such_method(request, route.as_str()))
}

/// The service, with the maps that the caller may name.
pub(super) struct Service(pub(super) MeteredService);

impl<S: Sync> FromRequestParts<S> for Service {
    type Rejection = HttpError;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, HttpError> {
        Ok(Self(Authorized::of(&parts.extensions)?.service.clone()))
    }
}
