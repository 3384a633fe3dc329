//! `POST /v1/maps/{map}/motions`: can a body move along these configurations?

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};

use super::answer::{Answer, Array};
use super::asked;
use super::body::{BodyField, IgnoredList, ignored_of};
use super::form::{CountsField, NumbersField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::object::Object;
use crate::http::params::Map;
use crate::planning::Unknown;
use crate::service::MotionCheck;
use crate::wire::json::ByKeyword;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct MotionsBody {
    body: Object<BodyField>,
    /// Seven numbers a link, link by link, configuration by configuration, motion by motion.
    configurations: NumbersField<7>,
    /// How many configurations each motion has.
    lengths: CountsField,
    step_m: Option<f32>,
    clearance_max_m: Option<f32>,
    #[serde(default)]
    ignored: IgnoredList,
    #[serde(default)]
    unknown: ByKeyword<Unknown>,
    #[serde(default)]
    level: u32,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    ignore_keep_outs: bool,
}

#[derive(Serialize)]
struct MotionsHead {
    motions: u64,
    free_count: u64,
}

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
    Answer { head: MotionsHead { motions, free_count }, version, arrays }.respond(form).await
}
