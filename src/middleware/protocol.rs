//! What differs between the protocols.

use std::time::Instant;

use axum::extract::Request;
use axum::middleware::Next;
use axum::response::Response;

use crate::access::Operation;
use crate::admission::Endings;
use crate::telemetry::RequestOutcome;
use mrol_service::ServiceError;

/// A protocol by which requests come: how it names operations, and how it tells failures.
pub trait Protocol: Clone + Send + Sync + 'static {
    /// The protocol's name in metrics and the log.
    const NAME: &'static str;

    /// The operation that a request asks for; none where it asks for nothing there is.
    fn operation(&self, request: &Request) -> Option<Operation>;

    /// The answer to a request that asks for nothing there is.
    fn no_operation(&self, request: &Request) -> Response;

    /// A failure as a response.
    fn refusal(&self, error: ServiceError) -> Response;

    /// What ends the answer to a request that began at `begin` before it is sent in full, besides the end of its
    /// caller's key.
    fn endings(&self, request: &Request, begin: Instant) -> Endings;

    /// Runs the request's handler, with what the protocol does to requests before it and to responses after it.
    ///
    /// # Errors
    /// Of the protocol's own, such as a deadline that is reached.
    fn handle(
        &self,
        request: Request,
        next: Next,
    ) -> impl Future<Output = Result<Response, ServiceError>> + Send;

    /// What a response says of how its request ended.
    fn outcome(&self, response: &Response) -> RequestOutcome;
}
