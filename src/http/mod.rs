//! The HTTP adapters, with the same meaning as gRPC: JSON for people, bytes for programs.

mod block;
mod body;
mod deletions;
mod error;
mod events;
mod filter_choice;
mod headers;
mod json;
mod keep_outs;
mod list;
mod localization;
mod map_file;
mod maps;
mod middleware;
mod object;
mod observers;
mod occupancy;
mod octets;
mod openapi;
mod params;
mod pieces;
mod probes;
mod question;
mod reader;
mod routes;
mod scans;
mod scrapes;
mod shapes;
mod starting;
mod trajectory;
mod undo;
mod unreadable;
mod viewer;
mod voxels;
mod watch;

pub use openapi::openapi_json;
pub use starting::starting;

use axum::Router;
use axum::extract::DefaultBodyLimit;

use crate::admission::Admission;
use crate::middleware::Middleware;
use crate::telemetry::Metrics;
use middleware::Http;
use scrapes::Scrapes;

/// What every handler has at hand, besides the service that its caller may use.
#[derive(Debug, Clone)]
struct Adapter {
    admission: Admission,
    metrics: Metrics,
    message_bytes_max: usize,
    scrapes: Scrapes,
}

/// All routes. Bodies of more than `message_bytes_max` are refused.
pub fn router(middleware: &Middleware, message_bytes_max: usize) -> Router {
    let (admission, metrics) = (middleware.admission().clone(), middleware.recorder().metrics().clone());
    let scrapes = Scrapes::new(admission.scrape_kept());
    let routes = routes::of_operations().layer(DefaultBodyLimit::max(message_bytes_max));
    middleware.wrap(Http, routes).with_state(Adapter { admission, metrics, message_bytes_max, scrapes })
}
