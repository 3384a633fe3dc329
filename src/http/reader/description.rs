//! `GET /openapi.json`: the description of the interface.

use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;

use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::NoParams;

/// Describes the HTTP interface: this document.
#[utoipa::path(
    get,
    path = "/openapi.json",
    responses((status = 200, description = "OpenAPI 3.1", body = Object, content_type = "application/json"))
)]
pub(crate) async fn describe(
    State(adapter): State<Adapter>,
    NoParams: NoParams,
) -> Result<impl IntoResponse, HttpError> {
    let headers = [(header::CONTENT_TYPE, "application/json"), (header::X_CONTENT_TYPE_OPTIONS, "nosniff")];
    Ok((headers, (adapter.description)()?))
}
