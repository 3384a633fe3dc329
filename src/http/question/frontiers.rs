//! `POST /v1/maps/{map}/frontiers`: where free space ends and nothing is known beyond.

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::answer::Answer;
use super::asked::asked;
use super::form::QuestionBody;
use crate::http::error::HttpError;
use crate::http::forms::Map;
use crate::http::forms::Object;
use crate::http::forms::{AnswerBytes, QuestionBytes};
use crate::http::middleware::Service;
use crate::json::{JsonPose, JsonVersion, Vector3};
use mrol_client::wire::pb;
use mrol_map::planning::{Frontier, FrontierView};
use mrol_service::FrontierQuestion;

/// Where frontiers are looked for.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"box": {"min_m": [-1, -1, 0], "max_m": [1, 1, 1]}}))]
pub(in crate::http) struct FrontiersBody {
    /// Where frontiers are looked for, at most `limits.frontier_cells_max` voxels.
    #[schema(value_type = CornersBody)]
    r#box: Object<CornersBody>,
    /// Voxels that a frontier has at least; 8 without.
    size_min: Option<u64>,
    /// How many are told, at most `limits.frontiers_max`; 100 without.
    frontiers_max: Option<u32>,
    /// How far from a frontier a view may stand, meters; 20 voxels without.
    standoff_m: Option<f64>,
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

/// A box along the map's axes, meters.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct CornersBody {
    /// Smallest coordinates.
    #[schema(value_type = Vector3)]
    min_m: [f64; 3],
    /// Largest coordinates.
    #[schema(value_type = Vector3)]
    max_m: [f64; 3],
}

/// Where free space ends and nothing is known beyond.
#[derive(Serialize, ToSchema)]
struct FrontiersHead {
    /// The frontiers, the largest first.
    frontiers: Vec<FrontierJson>,
    /// How many there are.
    frontiers_total: u64,
    /// How many voxels they have.
    voxels_total: u64,
}

/// The frontiers of a box.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct FrontiersResponse {
    #[serde(flatten)]
    head: FrontiersHead,
    #[serde(flatten)]
    version: JsonVersion,
}

/// A frontier.
#[derive(Serialize, ToSchema)]
struct FrontierJson {
    /// How many voxels it has.
    voxels: u64,
    /// The mean of their centers.
    #[schema(value_type = Vector3)]
    center_m: [f64; 3],
    /// Smallest coordinates of its bounding box.
    #[schema(value_type = Vector3)]
    min_m: [f64; 3],
    /// Largest coordinates of it.
    #[schema(value_type = Vector3)]
    max_m: [f64; 3],
    /// From where it is seen; null where from nowhere.
    view: Option<ViewJson>,
}

/// From where a frontier is seen.
#[derive(Serialize, ToSchema)]
struct ViewJson {
    /// Where the sensor stands, x towards the target.
    map_from_view: JsonPose,
    /// What it looks at.
    #[schema(value_type = Vector3)]
    target_m: [f64; 3],
    /// The turn about z, radians.
    yaw_rad: f64,
    /// The angle above the horizon, radians.
    elevation_rad: f64,
}

/// Lists where free space ends and nothing is known beyond.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/frontiers",
    request_body(content((FrontiersBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((
        status = 200,
        description = "Answered",
        content((FrontiersResponse = "application/json"), (AnswerBytes = "application/octet-stream"))
    ))
)]
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
    Answer { head, version, arrays: Vec::new() }.respond(form, &service).await
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
