//! What is answered while the maps are being opened: that the process lives, and how far that has come. The viewer's page is
//! there too, and says the same.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};

use super::error::HttpError;
use super::forms::NoParams;
use super::probes;
use super::probes::{OpeningResponse, ReadyResponse};
use super::viewer;
use crate::access::Access;
use mrol_service::{Reason, ServiceError};
use mrol_store::{Opened, OpeningProgress};

/// The routes of a server that is starting.
pub fn starting(progress: Arc<OpeningProgress>, access: Access) -> Router {
    Router::new()
        .route("/livez", get(probes::live))
        .route("/readyz", get(ready))
        .route("/", get(viewer::pages::index))
        .route("/viewer/{file}", get(viewer::pages::file))
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

/// `GET /readyz`: 503 with `{"ready":false,"reason":"starting","maps":3,"maps_open":1,"bytes":...,"bytes_read":...}`.
async fn ready(State(progress): State<Arc<OpeningProgress>>, NoParams: NoParams) -> Response {
    let Opened { bytes, bytes_read, maps, maps_open } = progress.opened();
    let opening = Some(OpeningResponse { maps, maps_open, bytes, bytes_read });
    let body = ReadyResponse { reason: Some("starting"), opening, ..ReadyResponse::default() };
    (StatusCode::SERVICE_UNAVAILABLE, [(header::RETRY_AFTER, "1")], Json(body)).into_response()
}

async fn refuse() -> HttpError {
    let message = "server is starting: /readyz tells how far it has come";
    ServiceError::new(Reason::Starting, message).into()
}
