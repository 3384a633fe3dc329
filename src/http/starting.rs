//! What is answered while the maps are being found: that the process lives, and how far that has come. The viewer's
//! page is there too, and says the same.

use axum::Router;
use axum::extract::{Request, State};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use super::error::HttpError;
use super::forms::NoParams;
use super::probes;
use super::probes::ReadyResponse;
use super::viewer;
use crate::access::Access;
use mrol_service::{Reason, ServiceError};
use mrol_store::OpeningProgress;

/// The routes of a server that is starting.
pub fn starting(progress: OpeningProgress, access: Access) -> Router {
    let pages =
        Router::new().route("/", get(viewer::pages::index)).route("/viewer/{file}", get(viewer::pages::file));
    answering(pages, progress, access)
}

/// The routes of its listener for health and metrics.
pub fn admin_starting(progress: OpeningProgress, access: Access) -> Router {
    answering(Router::new(), progress, access)
}

fn answering(others: Router<OpeningProgress>, progress: OpeningProgress, access: Access) -> Router {
    others
        .route("/livez", get(probes::live))
        .route("/readyz", get(ready))
        .fallback(refuse)
        .layer(from_fn_with_state(access, named))
        .with_state(progress)
}

/// Answers what names this server.
async fn named(State(access): State<Access>, request: Request, next: Next) -> Response {
    match access.check_host(&request) {
        Ok(()) => next.run(request).await,
        Err(refusal) => HttpError::from(refusal).into_response(),
    }
}

/// `GET /readyz`: 503, as while maps are being opened.
async fn ready(State(progress): State<OpeningProgress>, NoParams: NoParams) -> Response {
    ReadyResponse::starting(progress.opened())
}

async fn refuse() -> HttpError {
    let message = "server is starting: /readyz tells how far it has come";
    ServiceError::new(Reason::Starting, message).into()
}
