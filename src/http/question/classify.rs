//! `POST /v1/maps/{map}/classification`: points as what is known of them.

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
use crate::json::JsonVersion;
use mrol_client::wire::pb;
use mrol_service::ClassifyQuestion;

/// Points of which it is asked what is known.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"points": [[1, 1, 0.5], [0, 0, 1]]}))]
pub(in crate::http) struct ClassifyBody {
    /// The points.
    #[schema(value_type = JsonPoints)]
    points: PointsField,
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

/// What is told of classified points as numbers.
#[derive(Serialize, ToSchema)]
struct ClassifiedHead {
    /// How many points were asked about.
    points: u64,
    /// How many are occupied.
    points_occupied: u64,
    /// How many are free.
    points_free: u64,
}

/// What is known of points.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct ClassifiedResponse {
    #[serde(flatten)]
    head: ClassifiedHead,
    /// Whether each is occupied.
    occupied: Vec<bool>,
    /// Whether a scan saw through its voxel, and it is not occupied.
    free: Vec<bool>,
    #[serde(flatten)]
    version: JsonVersion,
}

/// Tells which points are occupied and which are free: what is neither is unknown.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/classification",
    request_body(content((ClassifyBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((ClassifiedResponse = "application/json"), (AnswerBytes = "application/octet-stream"))
    ))
)]
pub(in crate::http) async fn classify_points(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<ClassifyBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: ClassifyBody, arrays: &Bytes| {
        Ok(pb::ClassifyPointsRequest {
            asked: asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid),
            points: Some(of.points.into_message(arrays, "points")?),
        })
    };
    let (map, question): (_, ClassifyQuestion) = asking.question(&service, message).await?;
    let answered = service.ask(&map, question).await?;
    let version = answered.version;
    let response = pb::ClassifyPointsResponse::from(answered);
    let pb::ClassifyPointsResponse { points, points_occupied, points_free, .. } = response;
    let arrays = vec![
        ("occupied", Array::Bits(response.occupied, points as usize)),
        ("free", Array::Bits(response.free, points as usize)),
    ];
    let head = ClassifiedHead { points, points_occupied, points_free };
    Answer { head, version, arrays }.respond(form, &service).await
}
