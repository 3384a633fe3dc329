//! `POST /v1/maps/{map}/poses`: does a body fit at these configurations?

use axum::body::Bytes;
use axum::response::Response;
use serde::Deserialize;

use super::answer::Answer;
use super::asked;
use super::body::{AnswerWord, BodyField, IgnoredList, collisions_of, ignored_of};
use super::form::{NumbersField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::object::Object;
use crate::http::params::Map;
use crate::planning::Unknown;
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
    ignored: IgnoredList,
    #[serde(default)]
    unknown: ByKeyword<Unknown>,
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
    Answer { head, version: answered.version, arrays }.respond(form).await
}
