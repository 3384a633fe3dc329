//! gRPC as a protocol of the middleware: calls, deadlines, messages, status.

use std::time::Instant;

use axum::body::Body;
use axum::extract::Request;
use axum::http::HeaderMap;
use axum::middleware::Next;
use axum::response::Response;
use tokio::time::sleep_until;
use tonic::{Code, Status};

use super::decompression::{Compressed, Inflation};
use super::message_framing::WholeMessages;
use super::{deadline, not_grpc, status};
use crate::access::Operation;
use crate::admission::{Ending, Endings};
use crate::middleware::Protocol;
use crate::telemetry::RequestOutcome;
use mrol_client::wire::{REASON, status_of};
use mrol_map::util::excerpt;
use mrol_service::ServiceError;

/// gRPC, whose messages may have `message_bytes_max` bytes.
#[derive(Debug, Clone)]
pub(super) struct Grpc {
    pub(super) inflation: Inflation,
    pub(super) message_bytes_max: usize,
}

impl Protocol for Grpc {
    const NAME: &'static str = "grpc";

    fn operation(&self, request: &Request) -> Option<Operation> {
        Operation::of_call(request.uri().path()).filter(|_| not_grpc::is_call(request))
    }

    fn no_operation(&self, request: &Request) -> Response {
        not_grpc::refusal(request).unwrap_or_else(|| {
            Status::unimplemented(format!("no call {}", excerpt(request.uri().path()))).into_http()
        })
    }

    fn refusal(&self, error: ServiceError) -> Response {
        status_of(error).into_http()
    }

    fn endings(&self, request: &Request, begin: Instant) -> Endings {
        let deadline = deadline::of(request.headers()).and_then(|most| {
            // A deadline beyond all time is none.
            let end = begin.checked_add(most)?;
            Some(Box::pin(async move {
                sleep_until(end.into()).await;
                deadline::reached(most)
            }) as Ending)
        });
        Endings { when: deadline.into_iter().collect(), trailers }
    }

    async fn handle(&self, mut call: Request, next: Next) -> Result<Response, ServiceError> {
        let (deadline, compressed) = (deadline::of(call.headers()), Compressed::of(call.headers()));
        call.extensions_mut().insert(compressed);
        let call = call.map(|body| Body::new(WholeMessages::new(body, self.message_bytes_max)));
        let response = deadline::within(deadline, self.inflation.within(compressed, next.run(call))).await?;
        Ok(match Status::from_header_map(response.headers()) {
            Some(refused) => status::of_request(refused, self.message_bytes_max).into_http(),
            None => response,
        })
    }

    fn outcome(&self, response: &Response) -> RequestOutcome {
        if !response.status().is_success() {
            // It was no call.
            let code = response.status().as_str().to_owned().into();
            return RequestOutcome { code, is_ok: false, denial: None };
        }
        let headers = response.headers();
        let code = headers.get("grpc-status").map_or(Code::Ok, |value| Code::from_bytes(value.as_bytes()));
        status::outcome(code, headers.get(REASON).map(|reason| reason.as_bytes()))
    }
}

/// The status of a call that failed after a part of its answer was sent.
fn trailers(error: ServiceError) -> Option<HeaderMap> {
    let mut trailers = HeaderMap::new();
    // Without a status the client takes the call for cut, which it is.
    let _ = status_of(error).add_header(&mut trailers);
    Some(trailers)
}
