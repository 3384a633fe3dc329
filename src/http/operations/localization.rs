//! `POST /v1/maps/{map}/localize`: where a scan was taken, with no guess.

use axum::response::Json;
use serde::Deserialize;
use utoipa::ToSchema;

use crate::http::error::HttpError;
use crate::http::forms::JsonPoints;
use crate::http::forms::Object;
use crate::http::forms::PointBytes;
use crate::http::forms::{Map, Numbers3, Numbers6, params};
use crate::http::forms::{Points, points_of, two_forms};
use crate::http::middleware::Service;
use crate::json::{JsonLocalization, Vector3};
use mrol_map::align::localize::{Gravity, LocalizationQuery, MAP_DOWN, SearchBox};
use mrol_service::{LocalizationRequest, PointCloud, Reason, ServiceError};

two_forms! {
    /// A scan, and what is known of where it was taken.
    #[schema(example = json!({"points": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "gravity": {"in_sensor": [0, 0, -1]}}))]
    body LocalizationBody {
        /// The scan, in the sensor frame.
        points: JsonPoints,
        /// The direction in which things fall: makes the search about ten times as fast, and exhaustive.
        #[schema(value_type = Option<GravityBody>)]
        gravity: Option<Object<GravityBody>>,
        /// Where the scan may have been taken; the bulk of the map and around its trajectory without.
        #[schema(value_type = Option<SearchBoxBody>)]
        search_box: Option<Object<SearchBoxBody>>,
    }

    /// The parameters of a localization beside points as bytes:
    /// `gravity=x,y,z&map_gravity=x,y,z&search_box=x,y,z,x,y,z`.
    params LocalizationParams {
        /// The direction in which things fall, `x,y,z` in the sensor frame.
        #[param(value_type = Option<Numbers3>, inline)]
        gravity: Option<String>,
        /// The same in the map frame; `0,0,-1` without.
        #[param(value_type = Option<Numbers3>, inline)]
        map_gravity: Option<String>,
        /// Where the scan may have been taken: the smallest and the largest coordinates, `x,y,z,x,y,z`.
        #[param(value_type = Option<Numbers6>, inline)]
        search_box: Option<String>,
    }

    both {
        /// Seconds that the search may take, at most `limits.localization_time_max_s`.
        time_limit_s: Option<f64>,
        /// Places in the answer, at most `limits.localization_candidates_max`; 5 without.
        #[serde(default)]
        candidates: u32,
        /// Seed of the sampling: the same one gives the same answer; 0 without.
        #[serde(default)]
        seed: u64,
    }
}

/// The direction in which things fall.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct GravityBody {
    /// In the sensor frame; any length.
    #[schema(value_type = Vector3)]
    in_sensor: [f64; 3],
    /// In the map frame; `[0, 0, -1]` without.
    #[schema(value_type = Option<Vector3>)]
    in_map: Option<[f64; 3]>,
}

/// A box along the map's axes, meters.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct SearchBoxBody {
    /// Smallest coordinates.
    #[schema(value_type = Vector3)]
    min_m: [f64; 3],
    /// Largest coordinates.
    #[schema(value_type = Vector3)]
    max_m: [f64; 3],
}

type LocalizationPoints = Points<LocalizationBody, LocalizationParams>;

/// Finds where a scan was taken, with no guess.
///
/// A scan that fits nowhere, or in several places, is an answer and not an error.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/localize",
    params(LocalizationParams),
    request_body(content((LocalizationBody = "application/json"), (PointBytes = "application/octet-stream"))),
    responses((status = 200, description = "Answered", body = JsonLocalization))
)]
pub(crate) async fn localize(
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
