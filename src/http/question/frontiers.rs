//! `POST /v1/maps/{map}/frontiers`: where free space ends and nothing is known beyond.

use axum::body::Bytes;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::answer::Arrays;
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use super::scope::question_body;
use crate::http::forms::Object;
use crate::json::{JsonPose, JsonVersion, Vector3};
use mrol_client::wire::pb;
use mrol_map::planning::{Frontier, FrontierView};
use mrol_service::{FrontierQuestion, ServiceError};

question_body! {
    /// Where frontiers are looked for.
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
    }
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
pub(in crate::http) struct FrontiersHead {
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

question_handler! {
    /// Lists where free space ends and nothing is known beyond.
    list_frontiers, "/v1/maps/{map}/frontiers", FrontiersBody => FrontiersResponse
}

impl HttpQuestion for FrontiersBody {
    type Message = pb::ListFrontiersRequest;
    type Question = FrontierQuestion;
    type Head = FrontiersHead;

    fn into_message(self, scope: pb::Asked, _: &Bytes) -> Result<pb::ListFrontiersRequest, ServiceError> {
        let Self { r#box: Object(CornersBody { min_m, max_m }), size_min, frontiers_max, standoff_m, .. } =
            self;
        let corners = pb::Box { min_m: Some(min_m.into()), max_m: Some(max_m.into()) };
        let (asked, r#box) = (Some(scope), Some(corners));
        Ok(pb::ListFrontiersRequest { asked, r#box, size_min, frontiers_max, standoff_m })
    }

    fn answered(answer: AnswerOf<Self>) -> (FrontiersHead, Arrays) {
        let found = answer.answer;
        let head = FrontiersHead {
            frontiers: found.frontiers.into_iter().map(Into::into).collect(),
            frontiers_total: found.frontiers_total,
            voxels_total: found.voxels_total,
        };
        (head, Vec::new())
    }
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
