//! `POST /v1/maps/{map}/spheres`: do these spheres of the map frame meet voxels?

use axum::body::Bytes;
use axum::response::Response;
use serde::Deserialize;

use super::answer::Answer;
use super::asked;
use super::body::{AnswerWord, IgnoredList, collisions_of, ignored_of};
use super::form::{CountsField, NumbersField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::params::Map;
use crate::planning::Unknown;
use crate::service::SphereCheck;
use crate::wire::json::ByKeyword;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct SpheresBody {
    spheres: NumbersField<4>,
    /// How many spheres each group has; one each without.
    sizes: Option<CountsField>,
    #[serde(default)]
    padding_m: f32,
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

pub(in crate::http) async fn check_spheres(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<SpheresBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: SpheresBody, arrays: &Bytes| {
        let ByKeyword(answer) = of.answer;
        let spheres = of.spheres.into_bytes(arrays, "spheres")?;
        let sizes = match of.sizes {
            Some(sizes) => sizes.into_bytes(arrays, "sizes")?,
            None => CountsField::ones(spheres.len() / SPHERE_BYTES),
        };
        Ok(pb::CheckSpheresRequest {
            asked: asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid),
            spheres_f32le: spheres,
            sizes_u32le: sizes,
            padding_m: of.padding_m,
            ignored: ignored_of(of.ignored)?,
            unknown: pb::Unknown::from(of.unknown.0).into(),
            answer: pb::CheckAnswer::from(answer).into(),
            clearance_max_m: of.clearance_max_m,
        })
    };
    let (map, check): (_, SphereCheck) = asking.question(&service, message).await?;
    let answer = check.answer;
    let answered = service.ask(&map, check).await?;
    let (head, arrays) = collisions_of(answered.answer.into(), answer);
    Answer { head, version: answered.version, arrays }.respond(form).await
}

/// Bytes of a sphere.
const SPHERE_BYTES: usize = 4 * size_of::<f32>();
