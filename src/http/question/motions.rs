//! `POST /v1/maps/{map}/motions`: can a body move along these configurations?

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::answer::{Answer, Array};
use super::asked::asked;
use super::body::{BodyField, DescribedIgnored, IgnoredList, ignored_of};
use super::form::{CountsField, NumbersField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::forms::Map;
use crate::http::forms::Object;
use crate::http::forms::{AnswerBytes, QuestionBytes};
use crate::http::middleware::Service;
use crate::json::described;
use crate::json::{ByKeyword, JsonVersion, PoseNumbers};
use mrol_client::wire::pb;
use mrol_map::planning::Unknown;
use mrol_service::MotionCheck;

/// A body and its motions.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "body": {"links": [{"spheres": [[0, 0, 0, 0.2]]}]},
    "configurations": [[0, 0, 1, 0, 0, 0, 1], [0.5, 0, 1, 0, 0, 0, 1]], "lengths": [2]
}))]
pub(in crate::http) struct MotionsBody {
    /// The body.
    #[schema(value_type = BodyField)]
    body: Object<BodyField>,
    /// A pose `[x, y, z, qx, qy, qz, qw]` for each link, link by link, configuration by configuration, motion
    /// by motion.
    #[schema(value_type = Vec<PoseNumbers>)]
    configurations: NumbersField<7>,
    /// How many configurations each motion has.
    #[schema(value_type = Vec<u32>)]
    lengths: CountsField,
    /// How far a point of the body moves from one check to the next, at most, meters; half a voxel without.
    step_m: Option<f32>,
    /// How far clearances are told, meters; they are not told without.
    clearance_max_m: Option<f32>,
    /// Regions in which voxels do not count; 64 at most.
    #[schema(value_type = Vec<DescribedIgnored>, required = false)]
    #[serde(default)]
    ignored: IgnoredList,
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

/// What is told of motions as numbers.
#[derive(Serialize, ToSchema)]
struct MotionsHead {
    /// How many motions were checked.
    motions: u64,
    /// How many of them are free.
    free_count: u64,
}

/// Whether motions are free.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct MotionsResponse {
    #[serde(flatten)]
    head: MotionsHead,
    /// Whether the body meets nothing on its way.
    free: Vec<bool>,
    /// Where it first meets something, as a share of the motion; null where it is free.
    first_hits: Vec<Option<f32>>,
    /// The least distance along the way, meters, where that is asked for.
    #[schema(nullable = false)]
    clearances_m: Option<Vec<Option<f32>>>,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Tells whether a body can move along its motions.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/motions",
    request_body(content((MotionsBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((MotionsResponse = "application/json"), (AnswerBytes = "application/octet-stream"))
    ))
)]
pub(in crate::http) async fn check_motions(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<MotionsBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: MotionsBody, arrays: &Bytes| {
        let Object(body) = of.body;
        Ok(pb::CheckMotionsRequest {
            asked: asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid),
            body: Some(body.into_message(arrays)?),
            configurations_f32le: of.configurations.into_bytes(arrays, "configurations")?,
            lengths_u32le: of.lengths.into_bytes(arrays, "lengths")?,
            step_m: of.step_m,
            clearance_max_m: of.clearance_max_m,
            ignored: ignored_of(of.ignored)?,
            unknown: pb::Unknown::from(of.unknown.0).into(),
        })
    };
    let (map, check): (_, MotionCheck) = asking.question(&service, message).await?;
    let answered = service.ask(&map, check).await?;
    let version = answered.version;
    let response = pb::CheckMotionsResponse::from(answered);
    let pb::CheckMotionsResponse { motions, free_count, .. } = response;
    let mut arrays = vec![
        ("free", Array::Bits(response.free, motions as usize)),
        ("first_hits", Array::Floats(response.first_hits_f32le)),
    ];
    if !response.clearances_m_f32le.is_empty() {
        arrays.push(("clearances_m", Array::Floats(response.clearances_m_f32le)));
    }
    Answer { head: MotionsHead { motions, free_count }, version, arrays }.respond(form, &service).await
}
