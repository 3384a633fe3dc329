//! What orchestrators and Prometheus ask: answered whatever the pools are doing.

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use serde_json::{Value, json};

use super::Adapter;
use super::error::HttpError;
use super::middleware::Service;
use super::params::NoParams;
use crate::access::Authorized;
use crate::map::MapName;
use crate::service::{MapService, UnavailableMap};
use crate::telemetry::Metrics;

/// `GET /livez`: 200 while the process lives.
pub(super) async fn live(NoParams: NoParams) -> &'static str {
    "ok"
}

/// `GET /readyz`: 200 while requests are taken, 503 with the reason while they are not. Maps that take no changes since
/// their journal failed are named to whoever may name them; they answer queries all the same. So are maps that could not
/// be opened (`unavailable`), with what helps: the others are served. A server whose disk
/// or memory is nearly full stays ready, and `writes_refused` holds the reasons.
pub(super) async fn ready(
    State(adapter): State<Adapter>,
    Service(service): Service,
    NoParams: NoParams,
) -> (StatusCode, Json<Value>) {
    if adapter.admission.lifecycle().is_leaving() {
        (StatusCode::SERVICE_UNAVAILABLE, Json(json!({"ready": false, "reason": "draining"})))
    } else {
        let maps = service.read_only_maps();
        let named = |(map, reason): &(MapName, String)| json!({"map": map.as_str(), "reason": reason});
        let read_only: Vec<Value> = maps.iter().map(named).collect();
        let mut body = json!({"ready": true});
        if !read_only.is_empty() {
            body["read_only"] = read_only.into();
        }
        let maps = service.unavailable_maps();
        if !maps.is_empty() {
            let named = |map: &UnavailableMap| json!({"map": map.name.as_str(), "reason": map.reason});
            body["unavailable"] = maps.iter().map(named).collect();
        }
        let shortages = service.shortages();
        if !shortages.is_empty() {
            body["writes_refused"] = shortages.iter().map(|shortage| shortage.reason().as_str()).collect();
        }
        (StatusCode::OK, Json(body))
    }
}

/// `GET /metrics`: Prometheus' text form. One text answers all scrapes of a second.
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
    let maps = service.list_maps().await.unwrap_or_else(|error| {
        // The counters say most when the server is overloaded, so they are told without the maps.
        tracing::warn!(%error, "metrics without gauges of the maps");
        Vec::new()
    });
    metrics.render(&service.pools(), &service.map_names(), &maps, &service.unavailable_maps())
}
