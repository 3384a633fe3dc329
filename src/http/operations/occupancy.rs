//! `POST /v1/maps/{map}/occupancy`: are these points in occupied voxels?

use axum::http::{HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::error::HttpError;
use crate::http::forms::JsonPoints;
use crate::http::forms::Object;
use crate::http::forms::{BitmapBytes, PointBytes};
use crate::http::forms::{Map, Numbers7, params};
use crate::http::forms::{Points, points_of, two_forms};
use crate::http::headers;
use crate::http::middleware::Service;
use crate::http::pieces;
use crate::json::described;
use crate::json::{ByKeyword, JsonPose, JsonVersion};
use mrol_client::wire::{InField, uuid_from};
use mrol_map::geometry::Pose;
use mrol_map::map::Lookup;
use mrol_service::{PointAnswer, PointCloud, PointQuery, ServiceError};

two_forms! {
    /// Points, and where they are.
    #[schema(example = json!({"points": [[0, 0, 0], [1, 1, 0.5]]}))]
    body QueryBody {
        /// The points.
        points: JsonPoints,
        /// What places the points in the map; the identity without.
        #[schema(value_type = Option<JsonPose>)]
        map_from_points: Option<Object<JsonPose>>,
        /// The map that the answer must speak of: another one is refused (`map_replaced`).
        #[schema(format = "uuid")]
        map_uuid: Option<String>,
    }

    /// With points as bytes: where they are.
    params QueryParams {
        /// What places the points in the map, `x,y,z,qx,qy,qz,qw`; the identity without.
        #[param(value_type = Option<Numbers7>, inline)]
        pose: Option<String>,
        /// The map that the answer must speak of: another one is refused (`map_replaced`).
        #[param(format = "uuid")]
        map_uuid: Option<String>,
    }

    both {
        /// The level, 0 the finest; 0 without.
        #[serde(default)]
        level: u32,
        /// What is asked: the exact set, or the Bloom filter; `exact` without.
        #[serde(default)]
        lookup: ByKeyword<Lookup> as described::Lookup where required = false,
        /// The answer waits until the map has reached this revision, at most `limits.min_revision_wait_max_s`.
        min_revision: Option<u64>,
        /// Whether points in keep-outs count as occupied; false without.
        #[serde(default)]
        keep_out: bool,
    }
}

/// Which points are in occupied voxels.
#[derive(Serialize, ToSchema)]
struct QueryResponse {
    /// Whether each point is in an occupied voxel.
    occupied: Vec<bool>,
    /// How many are.
    points_occupied: usize,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Tells which points are in occupied voxels.
///
/// The answer has the form of the question: JSON, or a bitmap for points as bytes.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/occupancy",
    params(QueryParams),
    request_body(content((QueryBody = "application/json"), (PointBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((QueryResponse = "application/json"), (BitmapBytes = "application/octet-stream")),
        headers(
            ("mrol-points" = u64, description = "With bytes: how many points were asked about."),
            ("mrol-points-occupied" = u64, description = "With bytes: how many of them are occupied."),
            ("mrol-revision" = u64, description = "With bytes: the revision."),
            ("mrol-map-uuid" = String, description = "With bytes: the uuid of the map."),
            ("mrol-content-hash" = String, description = "With bytes: the hash of the finest voxels.")
        )
    ))
)]
pub(crate) async fn query(
    Service(service): Service,
    Map(map): Map,
    body: Points<QueryBody, QueryParams>,
) -> Result<Response, HttpError> {
    let (query, is_json) = match body {
        Points::Json(query) => (query.try_into()?, true),
        Points::Bytes(body, rest) => (rest.with(points_of(body)?)?, false),
    };
    let answer = service.query_points(&map, query).await?;
    match is_json {
        true => pieces::whole(&service, answer.points * BYTES_PER_POINT, || as_json(answer)).await,
        false => Ok(as_bitmap(answer)),
    }
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

/// Bytes of a point in an answer of JSON: `false` and a comma.
const BYTES_PER_POINT: usize = 6;

fn as_json(answer: PointAnswer) -> QueryResponse {
    let bit = |i: usize| answer.occupied[i / 8] >> (i % 8) & 1 == 1;
    QueryResponse {
        occupied: (0..answer.points).map(bit).collect(),
        points_occupied: answer.points_occupied,
        version: answer.version.into(),
    }
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
