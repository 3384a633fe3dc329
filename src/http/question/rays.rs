//! `POST /v1/maps/{map}/rays`: what each ray meets first.

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};

use super::answer::{Answer, Array};
use super::asked;
use super::form::{PointsField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::params::Map;
use crate::planning::Unknown;
use crate::service::RayQuestion;
use crate::wire::json::ByKeyword;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct RaysBody {
    origins: PointsField,
    directions: Option<PointsField>,
    ends: Option<PointsField>,
    range_m: Option<f64>,
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
struct RaysHead {
    rays: u64,
    hits: u64,
}

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
    Answer { head: RaysHead { rays, hits }, version, arrays }.respond(form).await
}
