//! What orchestrators and Prometheus ask: answered whatever the lanes are doing.

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use super::adapter::Adapter;
use super::error::{HttpError, Problem};
use super::forms::NoParams;
use super::middleware::Service;
use super::operations::UnavailableResponse;
use crate::access::Authorized;
use crate::telemetry::{Metrics, ServiceReading};
use mrol_service::MapService;
use mrol_store::Opened;

/// Whether requests are taken.
#[derive(Debug, Default, Serialize, ToSchema)]
pub(super) struct ReadyResponse {
    /// True where they are.
    pub(super) ready: bool,
    /// Why not: `starting`, `draining` or `behind`.
    #[schema(nullable = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) reason: Option<&'static str>,
    /// How far the maps are opened, while the server starts.
    #[serde(flatten)]
    pub(super) opening: Option<OpeningResponse>,
    /// Maps that take no changes.
    #[schema(required = false)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) read_only: Vec<UnavailableResponse>,
    /// Maps that could not be opened.
    #[schema(required = false)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) unavailable: Vec<UnavailableResponse>,
    /// Why changes of all maps are refused: `disk_full`, `memory_full`.
    #[schema(required = false)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) writes_refused: Vec<&'static str>,
}

/// How far the maps are opened.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct OpeningResponse {
    /// The number of maps.
    pub(super) maps: u64,
    /// How many are open.
    pub(super) maps_open: u64,
    /// Bytes of their files.
    pub(super) bytes: u64,
    /// How many were read.
    pub(super) bytes_read: u64,
}

impl ReadyResponse {
    /// 503 with `{"ready":false,"reason":"starting","maps":3,"maps_open":1,"bytes":...,"bytes_read":...}`.
    pub(super) fn starting(opened: Opened) -> Response {
        let Opened { bytes, bytes_read, maps, maps_open } = opened;
        let opening = Some(OpeningResponse { maps, maps_open, bytes, bytes_read });
        let body = Self { reason: Some("starting"), opening, ..Self::default() };
        (StatusCode::SERVICE_UNAVAILABLE, [(header::RETRY_AFTER, "1")], Json(body)).into_response()
    }
}

/// Tells that the process lives.
#[utoipa::path(
    get,
    path = "/livez",
    responses((status = 200, description = "It lives: `ok`", body = String, content_type = "text/plain; charset=utf-8"))
)]
pub(super) async fn live(NoParams: NoParams) -> &'static str {
    "ok"
}

/// Tells whether all maps are open and requests are taken.
///
/// While maps are being opened, those that are open are served: a request for another one waits for it. Maps
/// that take no changes since their journal failed are named to whoever may name them; they answer queries all
/// the same. So are maps that could not be opened, with what helps: the others are served. A
/// server whose disk or memory is nearly full stays ready. A node of a cluster that has not joined it, or is behind the
/// others for longer than `cluster.lag_max_s`, is not; it answers all the same.
#[utoipa::path(
    get,
    path = "/readyz",
    responses(
        (status = 200, description = "Requests are taken", body = ReadyResponse),
        (
            status = 503,
            description = "Requests are not taken, or too many ask",
            content((ReadyResponse = "application/json"), (Problem = "application/problem+json"))
        )
    )
)]
pub(super) async fn ready(
    State(adapter): State<Adapter>,
    Service(service): Service,
    NoParams: NoParams,
) -> Response {
    if adapter.admission.lifecycle().is_leaving() {
        let body = ReadyResponse { reason: Some("draining"), ..ReadyResponse::default() };
        (StatusCode::SERVICE_UNAVAILABLE, Json(body)).into_response()
    } else if let Some(opened) = service.opening() {
        ReadyResponse::starting(opened)
    } else if adapter.admission.lifecycle().is_behind() {
        let body = ReadyResponse { reason: Some("behind"), ..ReadyResponse::default() };
        (StatusCode::SERVICE_UNAVAILABLE, [(header::RETRY_AFTER, "1")], Json(body)).into_response()
    } else {
        let read_only = service.read_only_maps().into_iter();
        let body = ReadyResponse {
            ready: true,
            read_only: read_only.map(|(map, reason)| UnavailableResponse::new(&map, reason)).collect(),
            unavailable: service.unavailable_maps().into_iter().map(Into::into).collect(),
            writes_refused: service.shortages().iter().map(|shortage| shortage.reason().as_str()).collect(),
            ..ReadyResponse::default()
        };
        (StatusCode::OK, Json(body)).into_response()
    }
}

/// Tells the metrics in Prometheus' text form.
///
/// One text answers all scrapes of `scrape_kept_s`.
#[utoipa::path(
    get,
    path = "/metrics",
    responses((
        status = 200,
        description = "The metrics",
        body = String,
        content_type = "text/plain; version=0.0.4; charset=utf-8"
    ))
)]
pub(super) async fn metrics(
    State(adapter): State<Adapter>,
    NoParams: NoParams,
    request: Request,
) -> Result<impl IntoResponse, HttpError> {
    let Authorized { caller, service } = Authorized::of(request.extensions())?;
    let text =
        adapter.scrapes.text(caller.allowed_maps(), async || scrape(&adapter.metrics, service).await).await?;
    Ok(([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text))
}

async fn scrape(metrics: &Metrics, service: &MapService) -> String {
    let maps = service.list_open_maps().await.unwrap_or_else(|error| {
        // The counters say most when the server is overloaded, so they are told without the maps.
        tracing::warn!(%error, "metrics without gauges of the maps");
        Vec::new()
    });
    metrics.render(&ServiceReading {
        lanes: service.lanes().to_vec(),
        names: service.map_names(),
        maps,
        awake: service.maps_awake(),
        unavailable: service.unavailable_maps(),
        shared: service.shared_maps(),
    })
}
