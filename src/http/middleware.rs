//! HTTP as a protocol of the middleware: routes and problem documents.

use std::time::Instant;

use axum::extract::{FromRequestParts, MatchedPath, Request};
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::error;
use super::error::HttpError;
use crate::access::{Authorized, Operation};
use crate::admission::Endings;
use crate::middleware::Protocol;
use crate::telemetry::RequestOutcome;
use mrol_service::{MapService, ServiceError};

/// HTTP/1 and HTTP/2.
#[derive(Debug, Clone, Copy)]
pub(super) struct Http;

impl Protocol for Http {
    const NAME: &'static str = "http";

    fn operation(&self, request: &Request) -> Option<Operation> {
        let route = request.extensions().get::<MatchedPath>()?;
        Operation::of_request(request.method().as_str(), route.as_str())
    }

    fn no_operation(&self, request: &Request) -> Response {
        let error = match request.extensions().get::<MatchedPath>() {
            Some(route) => error::no_such_method(request, route.as_str()),
            None => error::no_such_route(request),
        };
        error.into_response()
    }

    fn refusal(&self, error: ServiceError) -> Response {
        HttpError::from(error).into_response()
    }

    fn endings(&self, _: &Request, _: Instant) -> Endings {
        // HTTP has no word for an answer that ends early: it is cut.
        Endings::none()
    }

    async fn handle(&self, request: Request, next: Next) -> Result<Response, ServiceError> {
        let uri = request.uri().clone();
        let mut response = next.run(request).await;
        error::locate(&mut response, &uri);
        Ok(response)
    }

    fn outcome(&self, response: &Response) -> RequestOutcome {
        let status = response.status();
        let denial = error::denial(response).map(Into::into);
        RequestOutcome { code: status.as_str().to_owned().into(), is_ok: status.is_success(), denial }
    }
}

/// The service, with the maps that the caller may name.
pub(super) struct Service(pub(super) MapService);

impl<S: Sync> FromRequestParts<S> for Service {
    type Rejection = HttpError;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, HttpError> {
        Ok(Self(Authorized::of(&parts.extensions)?.service.clone()))
    }
}
