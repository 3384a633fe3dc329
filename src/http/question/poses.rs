//! `POST /v1/maps/{map}/poses`: does a body fit at these configurations?

use axum::response::Response;
use serde::Deserialize;

use super::answer::Answer;
use super::asked;
use super::body::{AnswerWord, BodyField, IgnoredField, collisions_of, ignored_of};
use super::form::{NumbersField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::object::Object;
use crate::http::params::Map;
use crate::service::PoseCheck;
use crate::wire::json::ByKeyword;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct PosesBody {
    body: Object<BodyField>,
    /// Seven numbers a link, link by link.
    configurations: NumbersField<7>,
    #[serde(default)]
    ignored: Vec<IgnoredField>,
    #[serde(default)]
    answer: ByKeyword<AnswerWord>,
    clearance_max_m: Option<f32>,
    #[serde(default)]
    level: u32,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    ignore_keep_outs: bool,
}

pub(in crate::http) async fn check_poses(
    Service(service): Service,
    Map(map): Map,
    QuestionBody { head, arrays, form }: QuestionBody<PosesBody>,
) -> Result<Response, HttpError> {
    let PosesBody { body: Object(body), configurations, ignored, answer: ByKeyword(answer), .. } = head;
    let request = pb::CheckPosesRequest {
        asked: asked(&map, (head.level, head.ignore_keep_outs), head.min_revision, head.map_uuid),
        body: Some(body.into_message(&arrays)?),
        configurations_f32le: configurations.into_bytes(&arrays, "configurations")?,
        ignored: ignored_of(ignored)?,
        answer: pb::CheckAnswer::from(answer).into(),
        clearance_max_m: head.clearance_max_m,
    };
    let (map, check): (_, PoseCheck) = request.try_into()?;
    let answer = check.answer;
    let answered = service.ask(&map, check).await?;
    let (head, arrays) = collisions_of(answered.answer.into(), answer);
    Answer { head, version: answered.version, arrays }.respond(form)
}
