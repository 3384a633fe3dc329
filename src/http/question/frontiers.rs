//! `POST /v1/maps/{map}/frontiers`: where free space ends and nothing is known beyond.

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};

use super::answer::Answer;
use super::asked;
use super::form::QuestionBody;
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::object::Object;
use crate::http::params::Map;
use crate::planning::{Frontier, FrontierView};
use crate::service::FrontierQuestion;
use crate::wire::json::JsonPose;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct FrontiersBody {
    r#box: Object<CornersBody>,
    size_min: Option<u64>,
    frontiers_max: Option<u32>,
    standoff_m: Option<f64>,
    #[serde(default)]
    level: u32,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    ignore_keep_outs: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CornersBody {
    min_m: [f64; 3],
    max_m: [f64; 3],
}

#[derive(Serialize)]
struct FrontiersHead {
    frontiers: Vec<FrontierJson>,
    frontiers_total: u64,
    voxels_total: u64,
}

#[derive(Serialize)]
struct FrontierJson {
    voxels: u64,
    center_m: [f64; 3],
    min_m: [f64; 3],
    max_m: [f64; 3],
    view: Option<ViewJson>,
}

#[derive(Serialize)]
struct ViewJson {
    map_from_view: JsonPose,
    target_m: [f64; 3],
    yaw_rad: f64,
    elevation_rad: f64,
}

pub(in crate::http) async fn list_frontiers(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<FrontiersBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: FrontiersBody, _: &Bytes| {
        let Object(CornersBody { min_m, max_m }) = of.r#box;
        let FrontiersBody { size_min, frontiers_max, standoff_m, .. } = of;
        let asked = asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid);
        let corners = pb::Box { min_m: Some(min_m.into()), max_m: Some(max_m.into()) };
        Ok(pb::ListFrontiersRequest { asked, r#box: Some(corners), size_min, frontiers_max, standoff_m })
    };
    let (map, question): (_, FrontierQuestion) = asking.question(&service, message).await?;
    let answered = service.ask(&map, question).await?;
    let (version, told) = (answered.version, answered.answer);
    let head = FrontiersHead {
        frontiers: told.frontiers.into_iter().map(Into::into).collect(),
        frontiers_total: told.frontiers_total,
        voxels_total: told.voxels_total,
    };
    Answer { head, version, arrays: Vec::new() }.respond(form).await
}

impl From<Frontier> for FrontierJson {
    fn from(Frontier { voxels, center_m, min_m, max_m, view }: Frontier) -> Self {
        Self { voxels, center_m, min_m, max_m, view: view.map(Into::into) }
    }
}

impl From<FrontierView> for ViewJson {
    fn from(FrontierView { map_from_view, target_m, yaw_rad, elevation_rad }: FrontierView) -> Self {
        Self { map_from_view: (&map_from_view).into(), target_m, yaw_rad, elevation_rad }
    }
}
