//! `POST /v1/maps/{map}/poses`: does a body fit at these configurations?

use axum::body::Bytes;
use axum::response::Response;
use serde::Deserialize;
use utoipa::ToSchema;

use super::answer::Answer;
use super::asked::asked;
use super::body::CheckedResponse;
use super::body::{AnswerWord, BodyField, DescribedIgnored, IgnoredList, collisions_of, ignored_of};
use super::form::{NumbersField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::forms::Map;
use crate::http::forms::Object;
use crate::http::forms::{AnswerBytes, QuestionBytes};
use crate::http::middleware::Service;
use crate::json::described;
use crate::json::{ByKeyword, PoseNumbers};
use mrol_client::wire::pb;
use mrol_map::planning::Unknown;
use mrol_service::PoseCheck;

/// A body and its configurations.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "body": {"links": [{"spheres": [[0, 0, 0, 0.2]]}]}, "configurations": [[0, 0, 1, 0, 0, 0, 1]]
}))]
pub(in crate::http) struct PosesBody {
    /// The body.
    #[schema(value_type = BodyField)]
    body: Object<BodyField>,
    /// A pose `[x, y, z, qx, qy, qz, qw]` for each link, link by link, configuration by configuration.
    #[schema(value_type = Vec<PoseNumbers>)]
    configurations: NumbersField<7>,
    /// Regions in which voxels do not count; 64 at most.
    #[schema(value_type = Vec<DescribedIgnored>, required = false)]
    #[serde(default)]
    ignored: IgnoredList,
    /// What voxels are that no scan saw through: free or occupied; `free` without.
    #[schema(value_type = described::Unknown, required = false)]
    #[serde(default)]
    unknown: ByKeyword<Unknown>,
    /// What is told: whether there is a collision, the first one, or how far away the nearest voxel is;
    /// `colliding` without.
    #[schema(value_type = AnswerWord, required = false)]
    #[serde(default)]
    answer: ByKeyword<AnswerWord>,
    /// How far clearances are told, meters.
    clearance_max_m: Option<f32>,
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

/// Tells whether a body fits at its configurations.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/poses",
    request_body(content((PosesBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((CheckedResponse = "application/json"), (AnswerBytes = "application/octet-stream"))
    ))
)]
pub(in crate::http) async fn check_poses(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<PosesBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: PosesBody, arrays: &Bytes| {
        let (Object(body), ByKeyword(answer)) = (of.body, of.answer);
        Ok(pb::CheckPosesRequest {
            asked: asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid),
            body: Some(body.into_message(arrays)?),
            configurations_f32le: of.configurations.into_bytes(arrays, "configurations")?,
            ignored: ignored_of(of.ignored)?,
            unknown: pb::Unknown::from(of.unknown.0).into(),
            answer: pb::CheckAnswer::from(answer).into(),
            clearance_max_m: of.clearance_max_m,
        })
    };
    let (map, check): (_, PoseCheck) = asking.question(&service, message).await?;
    let answer = check.answer;
    let answered = service.ask(&map, check).await?;
    let (head, arrays) = collisions_of(answered.answer.into(), answer);
    Answer { head, version: answered.version, arrays }.respond(form, &service).await
}
