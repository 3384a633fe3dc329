//! What orchestrators and Prometheus ask: answered whatever the pools are doing.

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use serde_json::{Value, json};

use super::Adapter;
use super::around::Service;
use crate::map::MapName;
use crate::service::{Shortage, UnavailableMap};

/// `GET /livez`: 200 while the process lives.
pub(super) async fn live() -> &'static str {
    "ok"
}

/// `GET /readyz`: 200 while requests are taken, 503 with the reason while they are not. Maps that take no changes since
/// their journal failed are named to whoever may name them; they answer queries all the same. So are maps that could not
/// be opened (`unavailable`), with what helps: the others are served. A server whose disk
/// or memory is nearly full stays ready, and `writes_refused` holds the reasons.
pub(super) async fn ready(
    State(adapter): State<Adapter>,
    Service(service): Service,
) -> (StatusCode, Json<Value>) {
    if adapter.admission.lifecycle().is_draining() {
        (StatusCode::SERVICE_UNAVAILABLE, Json(json!({"ready": false, "reason": "draining"})))
    } else {
        let maps = service.maps().read_only_maps();
        let named = |(map, reason): &(MapName, String)| json!({"map": map.as_str(), "reason": reason});
        let read_only: Vec<Value> = maps.iter().map(named).collect();
        let mut body = json!({"ready": true});
        if !read_only.is_empty() {
            body["read_only"] = read_only.into();
        }
        let maps = service.maps().unavailable_maps();
        if !maps.is_empty() {
            let named = |map: &UnavailableMap| json!({"map": map.name.as_str(), "reason": map.reason});
            body["unavailable"] = maps.iter().map(named).collect();
        }
        let shortages = service.maps().shortages();
        if !shortages.is_empty() {
            body["writes_refused"] = shortages.iter().map(Shortage::reason).collect();
        }
        (StatusCode::OK, Json(body))
    }
}

/// `GET /metrics`: Prometheus' text form.
pub(super) async fn metrics(Service(service): Service) -> impl IntoResponse {
    let maps = service.maps().list_maps().await.unwrap_or_else(|error| {
        // The counters say most when the server is overloaded, so they are told without the maps.
        tracing::warn!(%error, "metrics without gauges of the maps");
        Vec::new()
    });
    let text = service.metrics().render(&service.maps().pools(), &maps, &service.maps().unavailable_maps());
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text)
}
