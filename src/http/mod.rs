//! The HTTP adapters, with the same meaning as gRPC: JSON for people, bytes for programs.

mod body;
mod deletions;
mod error;
mod headers;
mod json;
mod localization;
mod map_file;
mod maps;
mod middleware;
mod object;
mod occupancy;
mod params;
mod probes;
mod routes;
mod scans;
mod scrapes;
mod starting;
mod trajectory;
mod undo;
mod unreadable;
mod voxels;

pub use starting::starting;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::middleware::from_fn_with_state;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};

use crate::access::Gate;
use crate::admission::Admission;
use middleware::Around;
use scrapes::Scrapes;

/// What every handler has at hand, besides the service that its caller may use.
#[derive(Debug, Clone)]
struct Adapter {
    admission: Admission,
    message_bytes_max: usize,
    scrapes: Scrapes,
}

/// All routes. Bodies of more than `message_bytes_max` are refused.
pub fn router(gate: Gate, admission: Admission, message_bytes_max: usize) -> Router {
    let around = Around { gate, admission: admission.clone() };
    let scrapes = Scrapes::new(admission.scrape_kept());
    routes::of_operations()
        .layer(DefaultBodyLimit::max(message_bytes_max))
        .layer(from_fn_with_state(around, middleware::request))
        .layer(PropagateRequestIdLayer::x_request_id())
        .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
        .with_state(Adapter { admission, message_bytes_max, scrapes })
}
