//! `/v1/maps`: make, describe, list and delete maps.

use axum::http::StatusCode;
use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::body;
use super::error::HttpError;
use super::json::JsonState;
use super::middleware::Service;
use super::object::Object;
use super::parameters::{Map, NoParameters};
use crate::bloom::FilterSettings;
use crate::map::{LEVELS_DEFAULT, LevelInfo, MapSettings};
use crate::service::{MapInfo, MapStorage, UnavailableMap};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SettingsIn {
    resolution_m: f64,
    levels: Option<u32>,
    #[serde(default)]
    filter: Object<FilterIn>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilterIn {
    hashes: Option<u32>,
    bits_per_voxel: Option<f64>,
}

impl SettingsIn {
    fn or(self, filter: FilterSettings) -> MapSettings {
        let Object(given) = self.filter;
        MapSettings {
            resolution_m: self.resolution_m,
            levels: self.levels.unwrap_or(LEVELS_DEFAULT),
            filter: FilterSettings {
                hashes: given.hashes.unwrap_or(filter.hashes),
                bits_per_key: given.bits_per_voxel.unwrap_or(filter.bits_per_key),
            },
        }
    }
}

#[derive(Serialize)]
pub(super) struct MapOut {
    map: String,
    #[serde(flatten)]
    state: JsonState,
    settings: SettingsOut,
    levels: Vec<LevelOut>,
    scans: usize,
    robots: Vec<String>,
    set_bytes: usize,
    moment_bytes: usize,
    trajectory_bytes: usize,
    storage: Option<StorageOut>,
}

#[derive(Serialize)]
struct StorageOut {
    durable_revision: u64,
    snapshot_revision: u64,
    undo_from_revision: u64,
    read_only: Option<String>,
}

#[derive(Serialize)]
struct SettingsOut {
    resolution_m: f64,
    levels: u32,
    filter: FilterOut,
}

#[derive(Serialize)]
struct FilterOut {
    hashes: u32,
    bits_per_voxel: f64,
}

#[derive(Serialize)]
struct LevelOut {
    level: u32,
    resolution_m: f64,
    voxels: usize,
    plane_bytes: usize,
    counter_bytes: usize,
    false_positives_expected: f64,
    false_positives_equation_1: f64,
    false_positives_measured: Option<f64>,
}

#[derive(Serialize)]
pub(super) struct MapsOut {
    maps: Vec<MapOut>,
    /// Those that could not be opened.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    unavailable: Vec<UnavailableOut>,
}

#[derive(Serialize)]
struct UnavailableOut {
    map: String,
    reason: String,
}

pub(super) async fn create(
    Service(service): Service,
    Map(name): Map,
    body::Json(settings): body::Json<SettingsIn>,
) -> Result<(StatusCode, Json<MapOut>), HttpError> {
    let service = service.maps();
    let (info, created) = service.create_map(name, settings.or(service.default_filter())).await?;
    let status = if created { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, Json(info.into())))
}

pub(super) async fn describe(
    Service(service): Service,
    Map(name): Map,
    NoParameters: NoParameters,
) -> Result<Json<MapOut>, HttpError> {
    let info = service.maps().map_info(&name).await?;
    Ok(Json(info.into()))
}

pub(super) async fn list(
    Service(service): Service,
    NoParameters: NoParameters,
) -> Result<Json<MapsOut>, HttpError> {
    let service = service.maps();
    let maps = service.list_maps().await?.into_iter().map(Into::into).collect();
    let unavailable = service.unavailable_maps().into_iter();
    let out = |UnavailableMap { name, reason }| UnavailableOut { map: name.to_string(), reason };
    Ok(Json(MapsOut { maps, unavailable: unavailable.map(out).collect() }))
}

pub(super) async fn delete(
    Service(service): Service,
    Map(name): Map,
    NoParameters: NoParameters,
) -> Result<StatusCode, HttpError> {
    service.maps().delete_map(&name).await?;
    Ok(StatusCode::NO_CONTENT)
}

impl From<MapInfo> for MapOut {
    fn from(info: MapInfo) -> Self {
        Self {
            map: info.name.to_string(),
            state: info.state.into(),
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

impl From<MapStorage> for StorageOut {
    fn from(storage: MapStorage) -> Self {
        Self {
            durable_revision: storage.durable_revision,
            snapshot_revision: storage.snapshot_revision,
            undo_from_revision: storage.undo_from_revision,
            read_only: storage.failure,
        }
    }
}

impl From<MapSettings> for SettingsOut {
    fn from(MapSettings { resolution_m, levels, filter }: MapSettings) -> Self {
        let filter = FilterOut { hashes: filter.hashes, bits_per_voxel: filter.bits_per_key };
        Self { resolution_m, levels, filter }
    }
}

impl From<&LevelInfo> for LevelOut {
    fn from(info: &LevelInfo) -> Self {
        Self {
            level: info.level,
            resolution_m: info.resolution_m,
            voxels: info.voxels,
            plane_bytes: info.plane_bytes,
            counter_bytes: info.counter_bytes,
            false_positives_expected: info.expected_rate,
            false_positives_equation_1: info.ideal_false_positive_rate,
            false_positives_measured: info.measured_rate,
        }
    }
}
