//! `POST /v1/maps/{map}/nearest`: the occupied voxel nearest to each point.

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::answer::{Answer, Array};
use super::asked::asked;
use super::form::{PointsField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::forms::JsonPoints;
use crate::http::forms::Map;
use crate::http::forms::{AnswerBytes, QuestionBytes};
use crate::http::middleware::Service;
use crate::json::described;
use crate::json::{ByKeyword, JsonVersion, Vector3, VoxelIndex};
use mrol_client::wire::pb;
use mrol_map::planning::MeasuredTo;
use mrol_service::NearestQuestion;

/// Points, and how far to look.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"points": [[1, 1, 0.5]], "radius_m": 0.5}))]
pub(in crate::http) struct NearestBody {
    /// The points.
    #[schema(value_type = JsonPoints)]
    points: PointsField,
    /// How far a voxel may be, meters: more than 0, at most 64 voxels of the level.
    radius_m: f64,
    /// Whether distances are to cubes or to their centers; `cubes` without.
    #[schema(value_type = described::MeasuredTo, required = false)]
    #[serde(default)]
    to: ByKeyword<MeasuredTo>,
    /// The level, 0 the finest; 0 without.
    #[serde(default)]
    level: u32,
    /// The answer waits until the map has reached this revision, at most `limits.min_revision_wait_max_s`.
    min_revision: Option<u64>,
    /// The map that the answer must speak of: another one is refused (`map_replaced`).
    #[schema(format = "uuid")]
    map_uuid: Option<String>,
    /// Whether keep-outs count for nothing; false without: they count as occupied.
    #[serde(default)]
    ignore_keep_outs: bool,
}

/// What is told of nearest voxels as numbers.
#[derive(Serialize, ToSchema)]
struct NearestHead {
    /// How many points were asked about.
    points: u64,
}

/// The occupied voxel that is nearest to each point.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct NearestResponse {
    #[serde(flatten)]
    head: NearestHead,
    /// Whether there is one within the radius.
    found: Vec<bool>,
    /// How far away it is, meters; null where there is none.
    distances_m: Vec<Option<f32>>,
    /// The voxel; null where there is none.
    #[schema(value_type = Vec<Option<VoxelIndex>>)]
    voxels: Vec<Option<[i32; 3]>>,
    /// The unit vector away from it; zero where the point is in it, or there is none.
    #[schema(value_type = Vec<Vector3>)]
    away: Vec<[f32; 3]>,
    /// The keep-outs that were met instead of a voxel, null where none was; absent where none was at all.
    #[schema(nullable = false)]
    keep_outs: Option<Vec<Option<String>>>,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Finds the occupied voxel that is nearest to each point.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/nearest",
    request_body(content((NearestBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((NearestResponse = "application/json"), (AnswerBytes = "application/octet-stream"))
    ))
)]
pub(in crate::http) async fn find_nearest(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<NearestBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: NearestBody, arrays: &Bytes| {
        let ByKeyword(to) = of.to;
        Ok(pb::FindNearestRequest {
            asked: asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid),
            points: Some(of.points.into_message(arrays, "points")?),
            radius_m: of.radius_m,
            to: pb::MeasuredTo::from(to).into(),
        })
    };
    let (map, question): (_, NearestQuestion) = asking.question(&service, message).await?;
    let answered = service.ask(&map, question).await?;
    let version = answered.version;
    let response = pb::FindNearestResponse::from(answered);
    let points = response.points;
    let voxels = Array::voxels(response.voxels_u64le, &response.found, response.keep_outs.as_ref());
    let mut arrays = vec![
        ("found", Array::Bits(response.found, points as usize)),
        ("distances_m", Array::Floats(response.distances_m_f32le)),
        ("voxels", voxels),
        ("away", Array::Vectors(response.away_f32le)),
    ];
    arrays.extend(Array::keep_outs("keep_outs", response.keep_outs));
    Answer { head: NearestHead { points }, version, arrays }.respond(form, &service).await
}
