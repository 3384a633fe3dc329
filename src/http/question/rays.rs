//! `POST /v1/maps/{map}/rays`: what each ray meets first.

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
use crate::json::{ByKeyword, JsonVersion, VoxelIndex};
use mrol_client::wire::pb;
use mrol_map::planning::Unknown;
use mrol_service::RayQuestion;

/// Rays: their origins, and directions or ends.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"origins": [[0, 0, 1]], "directions": [[1, 0, 0]], "range_m": 10}))]
pub(in crate::http) struct RaysBody {
    /// Where the rays begin: one point for all, or one each.
    #[schema(value_type = JsonPoints)]
    origins: PointsField,
    /// Unit vectors along them; together with `range_m`.
    #[schema(value_type = Option<JsonPoints>)]
    directions: Option<PointsField>,
    /// Where they end, in the place of `directions`.
    #[schema(value_type = Option<JsonPoints>)]
    ends: Option<PointsField>,
    /// How far the rays reach, meters.
    range_m: Option<f64>,
    /// What voxels are that no scan saw through: free or occupied; `free` without.
    #[schema(value_type = described::Unknown, required = false)]
    #[serde(default)]
    unknown: ByKeyword<Unknown>,
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

/// What is told of rays as numbers.
#[derive(Serialize, ToSchema)]
struct RaysHead {
    /// How many rays were cast.
    rays: u64,
    /// How many of them met something.
    hits: u64,
}

/// What each ray meets first.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct RaysResponse {
    #[serde(flatten)]
    head: RaysHead,
    /// Whether it meets something.
    hit: Vec<bool>,
    /// How far away, meters; null where it meets nothing.
    distances_m: Vec<Option<f32>>,
    /// The voxel; null where it meets none.
    #[schema(value_type = Vec<Option<VoxelIndex>>)]
    voxels: Vec<Option<[i32; 3]>>,
    /// The keep-outs that were met instead of a voxel, null where none was; absent where none was at all.
    #[schema(nullable = false)]
    keep_outs: Option<Vec<Option<String>>>,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Tells what each ray meets first.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/rays",
    request_body(content((RaysBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((RaysResponse = "application/json"), (AnswerBytes = "application/octet-stream"))
    ))
)]
pub(in crate::http) async fn cast_rays(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<RaysBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: RaysBody, arrays: &Bytes| {
        let points =
            |field: Option<PointsField>, name| field.map(|of| of.into_message(arrays, name)).transpose();
        Ok(pb::CastRaysRequest {
            asked: asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid),
            origins: points(Some(of.origins), "origins")?,
            directions: points(of.directions, "directions")?,
            ends: points(of.ends, "ends")?,
            range_m: of.range_m,
            unknown: pb::Unknown::from(of.unknown.0).into(),
        })
    };
    let (map, question): (_, RayQuestion) = asking.question(&service, message).await?;
    let answered = service.ask(&map, question).await?;
    let version = answered.version;
    let response = pb::CastRaysResponse::from(answered);
    let (rays, hits) = (response.rays, response.hits);
    let voxels = Array::voxels(response.voxels_u64le, &response.hit, response.keep_outs.as_ref());
    let mut arrays = vec![
        ("hit", Array::Bits(response.hit, rays as usize)),
        ("distances_m", Array::Floats(response.distances_m_f32le)),
        ("voxels", voxels),
    ];
    arrays.extend(Array::keep_outs("keep_outs", response.keep_outs));
    Answer { head: RaysHead { rays, hits }, version, arrays }.respond(form, &service).await
}
