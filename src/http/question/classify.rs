//! `POST /v1/maps/{map}/classification`: points as what is known of them.

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};

use super::answer::{Answer, Array};
use super::asked;
use super::form::{PointsField, QuestionBody};
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::params::Map;
use crate::service::ClassifyQuestion;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct ClassifyBody {
    points: PointsField,
    #[serde(default)]
    level: u32,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    ignore_keep_outs: bool,
}

#[derive(Serialize)]
struct ClassifiedHead {
    points: u64,
    points_occupied: u64,
    points_free: u64,
}

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
    Answer { head, version, arrays }.respond(form).await
}
