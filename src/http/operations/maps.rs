//! `/v1/maps`: make, describe, list, rename and delete maps.

use axum::http::StatusCode;
use axum::response::{Json, Response};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::error::{Holder, HttpError};
use crate::http::forms::FilterChoice;
use crate::http::forms::body;
use crate::http::forms::{Map, NoParams};
use crate::http::middleware::Service;
use crate::http::pieces;
use crate::json::JsonMap;
use crate::json::described;
use mrol_client::wire::InField;
use mrol_map::bloom::FilterSettings;
use mrol_map::map::{LEVELS_DEFAULT, MapName, MapOrigin, MapSettings};
use mrol_service::{MapElsewhere, UnavailableMap};

/// The settings of a new map.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"resolution_m": 0.03, "levels": 6}))]
pub(crate) struct SettingsBody {
    /// Side of a finest voxel, meters.
    #[schema(minimum = 0.001, maximum = 100)]
    resolution_m: f64,
    /// The number of levels; 6 without.
    #[schema(minimum = 1, maximum = 12)]
    levels: Option<u32>,
    /// The Bloom filters, or `"none"`.
    #[serde(default)]
    filter: FilterChoice,
    /// Whether the map keeps moments of its points, by which scans are refined; true without.
    moments: Option<bool>,
    /// Where the map's origin lies in the frame of a survey, meters; kept with the map.
    origin_m: Option<[f64; 3]>,
}

impl SettingsBody {
    fn or(self, filter: FilterSettings) -> MapSettings {
        MapSettings {
            resolution_m: self.resolution_m,
            levels: self.levels.unwrap_or(LEVELS_DEFAULT),
            filter: self.filter.or(filter),
            moments: self.moments.unwrap_or(true),
            origin: self.origin_m.map(|position_m| MapOrigin { position_m }),
        }
    }
}

/// The maps that the caller may name.
#[derive(Serialize, ToSchema)]
pub(crate) struct MapsResponse {
    /// The maps, by name.
    maps: Vec<JsonMap>,
    /// The maps that could not be opened.
    #[schema(required = false)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    unavailable: Vec<UnavailableResponse>,
    /// The maps that other nodes of the cluster hold, and this one does not.
    #[schema(required = false)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    elsewhere: Vec<ElsewhereResponse>,
}

/// A map that other nodes of the cluster hold.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ElsewhereResponse {
    /// The name of the map.
    map: String,
    /// Those of its holders that are live, the best first; none where none of them is.
    holders: Vec<Holder>,
}

impl From<MapElsewhere> for ElsewhereResponse {
    fn from(MapElsewhere { name, holders }: MapElsewhere) -> Self {
        Self { map: name.to_string(), holders: holders.into_iter().map(Into::into).collect() }
    }
}

/// A map that is not served as it should be.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct UnavailableResponse {
    /// The name of the map.
    map: String,
    /// Why, and what helps.
    reason: String,
}

impl UnavailableResponse {
    /// The map with its reason.
    pub(crate) fn new(map: &MapName, reason: String) -> Self {
        Self { map: map.to_string(), reason }
    }
}

impl From<UnavailableMap> for UnavailableResponse {
    fn from(UnavailableMap { name, reason }: UnavailableMap) -> Self {
        Self::new(&name, reason)
    }
}

/// Makes a map.
///
/// The answer is 200 where the map was there with these settings; with others it is refused (`map_exists`).
#[utoipa::path(
    put,
    path = "/v1/maps/{map}",
    request_body = SettingsBody,
    responses(
        (status = 201, description = "Made", body = JsonMap),
        (status = 200, description = "Was there, with these settings", body = JsonMap)
    )
)]
pub(crate) async fn create(
    Service(service): Service,
    Map(name): Map,
    body::Json(settings): body::Json<SettingsBody>,
) -> Result<(StatusCode, Json<JsonMap>), HttpError> {
    let (info, created) = service.create_map(name, settings.or(service.default_filter())).await?;
    let status = if created { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, Json(info.into())))
}

/// Describes a map.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}",
    responses((status = 200, description = "Answered", body = JsonMap))
)]
pub(crate) async fn describe(
    Service(service): Service,
    Map(name): Map,
    NoParams: NoParams,
) -> Result<Json<JsonMap>, HttpError> {
    let info = service.map_info(&name).await?;
    Ok(Json(info.into()))
}

/// About as many bytes as a map takes as JSON.
const BYTES_PER_MAP: usize = 2048;

/// Lists the maps that the caller may name.
#[utoipa::path(
    get,
    path = "/v1/maps",
    responses((status = 200, description = "Answered", body = MapsResponse))
)]
pub(crate) async fn list(Service(service): Service, NoParams: NoParams) -> Result<Response, HttpError> {
    let (maps, unavailable) = (service.list_maps().await?, service.unavailable_maps());
    let elsewhere = service.maps_elsewhere();
    let bytes = (maps.len() + unavailable.len() + elsewhere.len()) * BYTES_PER_MAP;
    let listing = move || MapsResponse {
        maps: maps.into_iter().map(Into::into).collect(),
        unavailable: unavailable.into_iter().map(Into::into).collect(),
        elsewhere: elsewhere.into_iter().map(Into::into).collect(),
    };
    pieces::whole(&service, bytes, listing).await
}

/// The name that a map gets.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"to": "renamed"}))]
pub(crate) struct RenameBody {
    /// The name that no map has.
    #[schema(value_type = described::MapName)]
    to: String,
}

/// Gives a map another name.
///
/// Its uuid, its revision and its robots stay. Watches and changes that are under way under the former name end with
/// `map_not_found`. A name that a map has is refused (`map_exists`).
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/rename",
    request_body = RenameBody,
    responses((status = 200, description = "Renamed", body = JsonMap))
)]
pub(crate) async fn rename(
    Service(service): Service,
    Map(name): Map,
    body::Json(RenameBody { to }): body::Json<RenameBody>,
) -> Result<Json<JsonMap>, HttpError> {
    let to = MapName::new(&to).in_field("to")?;
    let info = service.rename_map(&name, &to).await?;
    Ok(Json(info.into()))
}

/// Deletes a map, its memory and its files.
#[utoipa::path(
    delete,
    path = "/v1/maps/{map}",
    responses((status = 204, description = "Gone"))
)]
pub(crate) async fn delete(
    Service(service): Service,
    Map(name): Map,
    NoParams: NoParams,
) -> Result<StatusCode, HttpError> {
    service.delete_map(&name).await?;
    Ok(StatusCode::NO_CONTENT)
}
