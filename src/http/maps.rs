//! `/v1/maps`: make, describe, list and delete maps.

use axum::http::StatusCode;
use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::body;
use super::error::HttpError;
use super::filter_choice::FilterChoice;
use super::middleware::Service;
use super::params::{Map, NoParams};
use crate::bloom::FilterSettings;
use crate::map::{LEVELS_DEFAULT, MapSettings};
use crate::service::UnavailableMap;
use crate::wire::json::JsonMap;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SettingsBody {
    resolution_m: f64,
    levels: Option<u32>,
    #[serde(default)]
    filter: FilterChoice,
    moments: Option<bool>,
}

impl SettingsBody {
    fn or(self, filter: FilterSettings) -> MapSettings {
        MapSettings {
            resolution_m: self.resolution_m,
            levels: self.levels.unwrap_or(LEVELS_DEFAULT),
            filter: self.filter.or(filter),
            moments: self.moments.unwrap_or(true),
        }
    }
}

#[derive(Serialize)]
pub(super) struct MapsResponse {
    maps: Vec<JsonMap>,
    /// The maps that could not be opened.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    unavailable: Vec<UnavailableResponse>,
}

#[derive(Serialize)]
struct UnavailableResponse {
    map: String,
    reason: String,
}

pub(super) async fn create(
    Service(service): Service,
    Map(name): Map,
    body::Json(settings): body::Json<SettingsBody>,
) -> Result<(StatusCode, Json<JsonMap>), HttpError> {
    let (info, created) = service.create_map(name, settings.or(service.default_filter())).await?;
    let status = if created { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, Json(info.into())))
}

pub(super) async fn describe(
    Service(service): Service,
    Map(name): Map,
    NoParams: NoParams,
) -> Result<Json<JsonMap>, HttpError> {
    let info = service.map_info(&name).await?;
    Ok(Json(info.into()))
}

pub(super) async fn list(
    Service(service): Service,
    NoParams: NoParams,
) -> Result<Json<MapsResponse>, HttpError> {
    let maps = service.list_maps().await?.into_iter().map(Into::into).collect();
    let unavailable = service.unavailable_maps().into_iter();
    let out = |UnavailableMap { name, reason }| UnavailableResponse { map: name.to_string(), reason };
    Ok(Json(MapsResponse { maps, unavailable: unavailable.map(out).collect() }))
}

pub(super) async fn delete(
    Service(service): Service,
    Map(name): Map,
    NoParams: NoParams,
) -> Result<StatusCode, HttpError> {
    service.delete_map(&name).await?;
    Ok(StatusCode::NO_CONTENT)
}
