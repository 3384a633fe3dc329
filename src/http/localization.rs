//! `POST /v1/maps/{map}/localize`: where a scan was taken, with no guess.

use axum::response::Json;
use serde::Deserialize;

use super::body::{Points, points_of};
use super::error::HttpError;
use super::json::JsonPoints;
use super::middleware::Service;
use super::object::Object;
use super::params::{self, Map};
use crate::align::localize::{Gravity, LocalizationQuery, MAP_DOWN, SearchBox};
use crate::service::{LocalizationRequest, PointCloud, Reason, ServiceError};
use crate::wire::json::JsonLocalization;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LocalizationBody {
    points: JsonPoints,
    gravity: Option<Object<GravityBody>>,
    search_box: Option<Object<BoxBody>>,
    time_limit_s: Option<f64>,
    #[serde(default)]
    candidates: u32,
    #[serde(default)]
    seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GravityBody {
    in_sensor: [f64; 3],
    in_map: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxBody {
    min_m: [f64; 3],
    max_m: [f64; 3],
}

/// The parameters of a localization beside points as bytes: `gravity=x,y,z&map_gravity=x,y,z&search_box=x,y,z,x,y,z`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LocalizationParams {
    gravity: Option<String>,
    map_gravity: Option<String>,
    search_box: Option<String>,
    time_limit_s: Option<f64>,
    #[serde(default)]
    candidates: u32,
    #[serde(default)]
    seed: u64,
}

type LocalizationPoints = Points<LocalizationBody, LocalizationParams>;

pub(super) async fn localize(
    Service(service): Service,
    Map(map): Map,
    scan: LocalizationPoints,
) -> Result<Json<JsonLocalization>, HttpError> {
    let answer = service.localize(&map, scan.try_into()?).await?;
    Ok(Json(answer.into()))
}

impl TryFrom<LocalizationPoints> for LocalizationRequest {
    type Error = ServiceError;

    fn try_from(body: LocalizationPoints) -> Result<Self, ServiceError> {
        match body {
            Points::Json(scan) => scan.try_into(),
            Points::Bytes(body, rest) => rest.with(points_of(body)?),
        }
    }
}

impl TryFrom<LocalizationBody> for LocalizationRequest {
    type Error = ServiceError;

    fn try_from(scan: LocalizationBody) -> Result<Self, ServiceError> {
        let gravity =
            scan.gravity.map(|Object(given)| Gravity::new(given.in_sensor, given.in_map.unwrap_or(MAP_DOWN)));
        let search_box = scan.search_box.map(|Object(given)| SearchBox::new(given.min_m, given.max_m));
        Ok(Self {
            points: scan.points.into(),
            query: LocalizationQuery {
                gravity: gravity.transpose()?,
                search_box: search_box.transpose()?,
                candidates: scan.candidates as usize,
                seed: scan.seed,
            },
            time_limit: scan.time_limit_s.map(LocalizationRequest::time_limit_of).transpose()?,
        })
    }
}

impl LocalizationParams {
    fn with(self, points: PointCloud) -> Result<LocalizationRequest, ServiceError> {
        let gravity = match (&self.gravity, &self.map_gravity) {
            (None, None) => None,
            (Some(in_sensor), in_map) => {
                let in_map = in_map.as_ref().map(|text| params::numbers(text, "map_gravity")).transpose()?;
                Some(Gravity::new(params::numbers(in_sensor, "gravity")?, in_map.unwrap_or(MAP_DOWN))?)
            }
            (None, Some(_)) => {
                let message = "map_gravity says nothing without gravity, the direction in the sensor frame";
                return Err(ServiceError::new(Reason::MissingField, message));
            }
        };
        let corners = |text: &String| -> Result<SearchBox, ServiceError> {
            let [x0, y0, z0, x1, y1, z1] = params::numbers(text, "search_box")?;
            Ok(SearchBox::new([x0, y0, z0], [x1, y1, z1])?)
        };
        Ok(LocalizationRequest {
            points,
            query: LocalizationQuery {
                gravity,
                search_box: self.search_box.as_ref().map(corners).transpose()?,
                candidates: self.candidates as usize,
                seed: self.seed,
            },
            time_limit: self.time_limit_s.map(LocalizationRequest::time_limit_of).transpose()?,
        })
    }
}
