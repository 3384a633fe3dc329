//! `POST /v1/maps/{map}/nearest`: the occupied voxel nearest to each point.

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};

use super::answer::{Answer, Array};
use super::asked;
use super::form::{PointsField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::params::Map;
use crate::planning::MeasuredTo;
use crate::service::NearestQuestion;
use crate::wire::json::ByKeyword;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct NearestBody {
    points: PointsField,
    radius_m: f64,
    #[serde(default)]
    to: ByKeyword<MeasuredTo>,
    #[serde(default)]
    level: u32,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    ignore_keep_outs: bool,
}

#[derive(Serialize)]
struct NearestHead {
    points: u64,
}

pub(in crate::http) async fn find_nearest(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<NearestBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: NearestBody, arrays: &Bytes| {
        let ByKeyword(to) = of.to;
        Ok(pb::FindNearestRequest {
            asked: asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid),
            points: Some(of.points.into_message(arrays, "points")?),
            radius_m: of.radius_m,
            to: pb::MeasuredTo::from(to).into(),
        })
    };
    let (map, question): (_, NearestQuestion) = asking.question(&service, message).await?;
    let answered = service.ask(&map, question).await?;
    let version = answered.version;
    let response = pb::FindNearestResponse::from(answered);
    let points = response.points;
    let voxels = Array::voxels(response.voxels_u64le, &response.found, response.keep_outs.as_ref());
    let mut arrays = vec![
        ("found", Array::Bits(response.found, points as usize)),
        ("distances_m", Array::Floats(response.distances_m_f32le)),
        ("voxels", voxels),
        ("away", Array::Vectors(response.away_f32le)),
    ];
    arrays.extend(Array::keep_outs("keep_outs", response.keep_outs));
    Answer { head: NearestHead { points }, version, arrays }.respond(form).await
}
