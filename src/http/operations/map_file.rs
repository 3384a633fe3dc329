//! `/v1/maps/{map}/snapshot`: a map out of the server as a map file, and a map from one.

use std::convert::Infallible;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use serde::Deserialize;
use utoipa::IntoParams;

use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::MapFileBytes;
use crate::http::forms::body;
use crate::http::forms::{Map, NoParams, Params};
use crate::http::headers;
use crate::http::middleware::Service;
use crate::json::JsonMap;
use mrol_client::wire::snapshot_pieces;

/// Gives out a map at one revision as a map file.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/snapshot",
    responses((
        status = 200,
        description = "Answered",
        body = MapFileBytes,
        content_type = "application/octet-stream",
        headers(
            ("mrol-revision" = u64, description = "The revision."),
            ("mrol-map-uuid" = String, description = "The uuid of the map."),
            ("mrol-content-hash" = String, description = "The hash of the finest voxels.")
        )
    ))
)]
pub(crate) async fn take(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    NoParams: NoParams,
) -> Result<Response, HttpError> {
    let file = service.snapshot_map(&map).await?;
    let mut headers = headers::of_version(&file.version);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    headers.insert(header::CONTENT_LENGTH, file.bytes.len().into());
    let attachment = format!("attachment; filename=\"{map}.mrol\"");
    if let Ok(attachment) = HeaderValue::try_from(attachment) {
        headers.insert(header::CONTENT_DISPOSITION, attachment);
    }
    let kept = adapter.admission.keep(file.bytes.len())?;
    let pieces = snapshot_pieces(file).map(move |piece| {
        let _until_sent = &kept;
        Ok::<_, Infallible>(piece.data)
    });
    Ok((headers, Body::from_stream(tokio_stream::iter(pieces))).into_response())
}

/// The parameters of a restore.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct RestoreParams {
    /// Take the place of the map of that name, which is kept under another; false without.
    #[serde(default)]
    replace: bool,
}

/// Makes a map from a map file, of at most `limits.map_file_bytes_max` bytes.
#[utoipa::path(
    put,
    path = "/v1/maps/{map}/snapshot",
    params(RestoreParams),
    request_body(content = MapFileBytes, content_type = "application/octet-stream"),
    responses((status = 201, description = "Made", body = JsonMap))
)]
pub(crate) async fn restore(
    Service(service): Service,
    Map(map): Map,
    Params(RestoreParams { replace }): Params<RestoreParams>,
    request: Request,
) -> Result<(StatusCode, Json<JsonMap>), HttpError> {
    let file = body::octets(request, service.limits().map_file_bytes_max, "map_file_bytes_max").await?;
    let info = service.restore_map(map, file, replace).await?;
    Ok((StatusCode::CREATED, Json(info.into())))
}
