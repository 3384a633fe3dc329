//! The HTTP adapters, with the same meaning as gRPC: JSON for people, bytes for programs.

mod around;
mod body;
mod deletions;
mod error;
mod headers;
mod json;
mod localization;
mod map_file;
mod maps;
mod occupancy;
mod parameters;
mod probes;
mod routes;
mod scans;
mod starting;
mod trajectory;
mod undo;
mod voxels;

pub use starting::starting;

use std::time::Duration;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::middleware::from_fn_with_state;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::timeout::RequestBodyTimeoutLayer;

use crate::access::Gate;
use crate::lifecycle::Lifecycle;
use around::Around;

/// How long a client may be silent in the middle of a body.
const BODY_SILENCE_MAX: Duration = Duration::from_secs(30);

/// What every handler has at hand, besides the service that its caller may use.
#[derive(Debug, Clone)]
struct Adapter {
    lifecycle: Lifecycle,
    message_bytes_max: usize,
}

/// All routes. Bodies of more than `message_bytes_max` are refused.
pub fn router(gate: Gate, lifecycle: Lifecycle, message_bytes_max: usize) -> Router {
    let around = Around { gate, lifecycle: lifecycle.clone() };
    routes::of_operations()
        .layer(RequestBodyTimeoutLayer::new(BODY_SILENCE_MAX))
        .layer(DefaultBodyLimit::max(message_bytes_max))
        .layer(from_fn_with_state(around, around::request))
        .layer(PropagateRequestIdLayer::x_request_id())
        .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
        .with_state(Adapter { lifecycle, message_bytes_max })
}
