//! `POST /v1/maps/{map}/occupancy`: are these points in occupied voxels?

use axum::http::{HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Json, Response};
use serde::{Deserialize, Serialize};

use super::body::{Points, points_of};
use super::error::HttpError;
use super::headers;
use super::json::JsonPoints;
use super::middleware::Service;
use super::object::Object;
use super::params::{self, Map};
use crate::geometry::Pose;
use crate::map::Lookup;
use crate::service::{PointAnswer, PointCloud, PointQuery, ServiceError};
use crate::wire::json::ByKeyword;
use crate::wire::json::{JsonPose, JsonVersion};
use crate::wire::{InField, uuid_from};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct QueryBody {
    points: JsonPoints,
    map_from_points: Option<Object<JsonPose>>,
    #[serde(default)]
    level: u32,
    #[serde(default)]
    lookup: ByKeyword<Lookup>,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    keep_out: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct QueryParams {
    pose: Option<String>,
    #[serde(default)]
    level: u32,
    #[serde(default)]
    lookup: ByKeyword<Lookup>,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    keep_out: bool,
}

#[derive(Serialize)]
struct QueryResponse {
    occupied: Vec<bool>,
    points_occupied: usize,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Answers in the form of the question: JSON, or a bitmap.
pub(super) async fn query(
    Service(service): Service,
    Map(map): Map,
    body: Points<QueryBody, QueryParams>,
) -> Result<Response, HttpError> {
    let (query, answer_with): (_, fn(PointAnswer) -> Response) = match body {
        Points::Json(query) => (query.try_into()?, as_json),
        Points::Bytes(body, rest) => (rest.with(points_of(body)?)?, as_bitmap),
    };
    let answer = service.query_points(&map, query).await?;
    Ok(answer_with(answer))
}

impl TryFrom<QueryBody> for PointQuery {
    type Error = ServiceError;

    fn try_from(query: QueryBody) -> Result<Self, ServiceError> {
        let pose = query.map_from_points.map(|Object(pose)| Pose::try_from(pose).in_field("map_from_points"));
        Ok(Self {
            points: query.points.into(),
            map_from_points: pose.transpose()?,
            level: query.level,
            lookup: query.lookup.0,
            min_revision: query.min_revision,
            map_uuid: query.map_uuid.map(|uuid| uuid_from(&uuid)).transpose()?,
            keep_out: query.keep_out,
        })
    }
}

impl QueryParams {
    fn with(self, points: PointCloud) -> Result<PointQuery, ServiceError> {
        Ok(PointQuery {
            points,
            map_from_points: self.pose.map(|text| params::pose(&text, "pose")).transpose()?,
            level: self.level,
            lookup: self.lookup.0,
            min_revision: self.min_revision,
            map_uuid: self.map_uuid.map(|uuid| uuid_from(&uuid)).transpose()?,
            keep_out: self.keep_out,
        })
    }
}

fn as_json(answer: PointAnswer) -> Response {
    let bit = |i: usize| answer.occupied[i / 8] >> (i % 8) & 1 == 1;
    Json(QueryResponse {
        occupied: (0..answer.points).map(bit).collect(),
        points_occupied: answer.points_occupied,
        version: answer.version.into(),
    })
    .into_response()
}

fn as_bitmap(answer: PointAnswer) -> Response {
    let mut response = answer.occupied.into_response();
    let all = response.headers_mut();
    all.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    let mut number = |name, value: usize| all.insert(HeaderName::from_static(name), value.into());
    number("mrol-points", answer.points);
    number("mrol-points-occupied", answer.points_occupied);
    all.extend(headers::of_version(&answer.version));
    response
}
