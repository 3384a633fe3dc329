//! All routes of HTTP.

use axum::Router;
use axum::extract::DefaultBodyLimit;

use super::adapter::Adapter;
use super::middleware::Http;
use super::openapi::openapi_json;
use super::routes;
use super::scrapes::Scrapes;
use crate::middleware::Middleware;

/// All routes. Bodies of more than `message_bytes_max` are refused.
pub fn router(middleware: &Middleware, message_bytes_max: usize) -> Router {
    served(middleware, routes::of_operations(), message_bytes_max)
}

/// Health and metrics, and nothing else.
pub fn admin_router(middleware: &Middleware, message_bytes_max: usize) -> Router {
    served(middleware, routes::of_probes(), message_bytes_max)
}

fn served(middleware: &Middleware, routes: Router<Adapter>, message_bytes_max: usize) -> Router {
    let (admission, metrics) = (middleware.admission().clone(), middleware.recorder().metrics().clone());
    let scrapes = Scrapes::new(admission.scrape_kept());
    let description = openapi_json;
    let adapter = Adapter { admission, metrics, message_bytes_max, scrapes, description };
    let routes = routes.layer(DefaultBodyLimit::max(message_bytes_max));
    middleware.wrap(Http, routes).with_state(adapter)
}
