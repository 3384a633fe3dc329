//! `POST /v1/maps/{map}/spheres`: do these spheres of the map frame meet voxels?

use axum::body::Bytes;
use axum::response::Response;
use serde::Deserialize;
use utoipa::ToSchema;

use super::answer::Answer;
use super::asked::asked;
use super::body::CheckedResponse;
use super::body::{AnswerWord, DescribedIgnored, IgnoredList, collisions_of, ignored_of};
use super::form::{CountsField, NumbersField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::forms::Map;
use crate::http::forms::{AnswerBytes, QuestionBytes};
use crate::http::middleware::Service;
use crate::json::described;
use crate::json::{ByKeyword, Sphere};
use mrol_client::wire::pb;
use mrol_map::planning::Unknown;
use mrol_service::SphereCheck;

/// Spheres of the map frame.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"spheres": [[1, 1, 0.5, 0.2]], "answer": "first_hit"}))]
pub(in crate::http) struct SpheresBody {
    /// Spheres `[x, y, z, radius]` in the map frame, meters.
    #[schema(value_type = Vec<Sphere>)]
    spheres: NumbersField<4>,
    /// How many spheres each group has; one each without.
    #[schema(value_type = Option<Vec<u32>>)]
    sizes: Option<CountsField>,
    /// What every radius grows by, meters; 0 without.
    #[serde(default)]
    padding_m: f32,
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

/// Tells whether spheres of the map frame meet voxels.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/spheres",
    request_body(content((SpheresBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((CheckedResponse = "application/json"), (AnswerBytes = "application/octet-stream"))
    ))
)]
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
    Answer { head, version: answered.version, arrays }.respond(form, &service).await
}

/// Bytes of a sphere.
const SPHERE_BYTES: usize = 4 * size_of::<f32>();
