//! What happens around every request: its span, the refusal while draining, its count.

use std::time::Instant;

use axum::extract::{MatchedPath, Request, State};
use axum::http::Method;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tower_http::request_id::RequestId;
use tracing::Instrument;

use super::Adapter;
use super::error::HttpError;

pub(super) async fn request(State(adapter): State<Adapter>, request: Request, next: Next) -> Response {
    let route = request.extensions().get::<MatchedPath>().map(MatchedPath::as_str);
    let (start, operation) = (Instant::now(), operation(request.method(), route.unwrap_or_default()));
    let id = request.extensions().get::<RequestId>().and_then(|id| id.header_value().to_str().ok());
    let span = tracing::info_span!("http", operation, request_id = id);
    let answer = adapter.lifecycle.admit(next.run(request).instrument(span)).await;
    let response = answer.unwrap_or_else(|refusal| HttpError::from(refusal).into_response());
    let (status, elapsed) = (response.status(), start.elapsed());
    adapter.service.metrics().request("http", operation, status.as_str().to_owned(), elapsed);
    tracing::debug!(operation, status = status.as_u16(), ?elapsed, "http request");
    response
}

/// The name of a request for metrics and the log, the same as gRPC's. Whatever a client may send, it is one of
/// few.
fn operation(method: &Method, route: &str) -> &'static str {
    match (method.as_str(), route) {
        ("GET" | "HEAD", "/v1/maps") => "ListMaps",
        ("PUT", "/v1/maps/{map}") => "CreateMap",
        ("GET" | "HEAD", "/v1/maps/{map}") => "GetMap",
        ("DELETE", "/v1/maps/{map}") => "DeleteMap",
        ("POST", "/v1/maps/{map}/scans") => "InsertScan",
        ("POST", "/v1/maps/{map}/alignment") => "AlignScan",
        ("POST", "/v1/maps/{map}/occupancy") => "QueryPoints",
        ("POST", "/v1/maps/{map}/deletions") => "DeleteVoxels",
        ("POST", "/v1/maps/{map}/undo") => "UndoScans",
        ("GET" | "HEAD", "/v1/maps/{map}/trajectory") => "GetTrajectory",
        ("GET" | "HEAD", "/v1/maps/{map}/voxels") => "ListVoxels",
        _ => "unknown",
    }
}
