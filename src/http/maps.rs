//! `/v1/maps`: make, describe, list and delete maps.

use axum::http::StatusCode;
use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::body;
use super::error::HttpError;
use super::json::JsonVersion;
use super::middleware::Service;
use super::object::Object;
use super::params::{Map, NoParams};
use crate::bloom::FilterSettings;
use crate::map::{LEVELS_DEFAULT, LevelInfo, MapSettings};
use crate::service::{MapInfo, MapStorage, UnavailableMap};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SettingsBody {
    resolution_m: f64,
    levels: Option<u32>,
    #[serde(default)]
    filter: Object<FilterBody>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilterBody {
    hashes: Option<u32>,
    bits_per_key: Option<f64>,
}

impl SettingsBody {
    fn or(self, filter: FilterSettings) -> MapSettings {
        let Object(given) = self.filter;
        MapSettings {
            resolution_m: self.resolution_m,
            levels: self.levels.unwrap_or(LEVELS_DEFAULT),
            filter: FilterSettings {
                hashes: given.hashes.unwrap_or(filter.hashes),
                bits_per_key: given.bits_per_key.unwrap_or(filter.bits_per_key),
            },
        }
    }
}

#[derive(Serialize)]
pub(super) struct MapResponse {
    map: String,
    #[serde(flatten)]
    version: JsonVersion,
    settings: SettingsResponse,
    levels: Vec<LevelResponse>,
    scans: usize,
    robots: Vec<String>,
    set_bytes: usize,
    moment_bytes: usize,
    trajectory_bytes: usize,
    storage: Option<StorageResponse>,
}

#[derive(Serialize)]
struct StorageResponse {
    durable_revision: u64,
    snapshot_revision: u64,
    undo_from_revision: u64,
    read_only: Option<String>,
}

#[derive(Serialize)]
struct SettingsResponse {
    resolution_m: f64,
    levels: u32,
    filter: FilterResponse,
}

#[derive(Serialize)]
struct FilterResponse {
    hashes: u32,
    bits_per_key: f64,
}

#[derive(Serialize)]
struct LevelResponse {
    level: u32,
    resolution_m: f64,
    voxels: usize,
    plane_bytes: usize,
    counter_bytes: usize,
    expected_false_positive_rate: f64,
    ideal_false_positive_rate: f64,
    measured_false_positive_rate: Option<f64>,
}

#[derive(Serialize)]
pub(super) struct MapsResponse {
    maps: Vec<MapResponse>,
    /// Those that could not be opened.
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
) -> Result<(StatusCode, Json<MapResponse>), HttpError> {
    let (info, created) = service.create_map(name, settings.or(service.default_filter())).await?;
    let status = if created { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, Json(info.into())))
}

pub(super) async fn describe(
    Service(service): Service,
    Map(name): Map,
    NoParams: NoParams,
) -> Result<Json<MapResponse>, HttpError> {
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

impl From<MapInfo> for MapResponse {
    fn from(info: MapInfo) -> Self {
        Self {
            map: info.name.to_string(),
            version: info.version.into(),
            settings: info.settings.into(),
            levels: info.levels.iter().map(Into::into).collect(),
            scans: info.scans,
            robots: info.robots.iter().map(ToString::to_string).collect(),
            set_bytes: info.set_bytes,
            moment_bytes: info.moment_bytes,
            trajectory_bytes: info.trajectory_bytes,
            storage: info.storage.map(Into::into),
        }
    }
}

impl From<MapStorage> for StorageResponse {
    fn from(storage: MapStorage) -> Self {
        Self {
            durable_revision: storage.durable_revision,
            snapshot_revision: storage.snapshot_revision,
            undo_from_revision: storage.undo_from_revision,
            read_only: storage.failure,
        }
    }
}

impl From<MapSettings> for SettingsResponse {
    fn from(MapSettings { resolution_m, levels, filter }: MapSettings) -> Self {
        let filter = FilterResponse { hashes: filter.hashes, bits_per_key: filter.bits_per_key };
        Self { resolution_m, levels, filter }
    }
}

impl From<&LevelInfo> for LevelResponse {
    fn from(info: &LevelInfo) -> Self {
        Self {
            level: info.level,
            resolution_m: info.resolution_m,
            voxels: info.voxels,
            plane_bytes: info.plane_bytes,
            counter_bytes: info.counter_bytes,
            expected_false_positive_rate: info.expected_rate,
            ideal_false_positive_rate: info.ideal_false_positive_rate,
            measured_false_positive_rate: info.measured_rate,
        }
    }
}
