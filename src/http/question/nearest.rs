//! `POST /v1/maps/{map}/nearest`: the occupied voxel nearest to each point.

use axum::body::Bytes;
use serde::Serialize;
use utoipa::ToSchema;

use super::answer::{Array, Arrays};
use super::form::PointsField;
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use super::scope::question_body;
use crate::http::forms::JsonPoints;
use crate::json::described;
use crate::json::{ByKeyword, JsonVersion, Vector3, VoxelIndex};
use mrol_client::wire::pb;
use mrol_map::planning::MeasuredTo;
use mrol_service::{NearestQuestion, ServiceError};

question_body! {
    /// Points, and how far to look.
    #[schema(example = json!({"points": [[1, 1, 0.5]], "radius_m": 0.5}))]
    pub(in crate::http) struct NearestBody {
        /// The points.
        #[schema(value_type = JsonPoints)]
        points: PointsField,
        /// How far a voxel may be, meters: more than 0, at most 64 voxels of the level.
        radius_m: f64,
        /// Whether distances are to cubes or to their centers; `cubes` without.
        #[schema(value_type = described::MeasuredTo, required = false)]
        #[serde(default)]
        to: ByKeyword<MeasuredTo>,
    }
}

/// What is told of nearest voxels as numbers.
#[derive(Serialize, ToSchema)]
pub(in crate::http) struct NearestHead {
    /// How many points were asked about.
    points: u64,
}

/// The occupied voxel that is nearest to each point.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct NearestResponse {
    #[serde(flatten)]
    head: NearestHead,
    /// Whether there is one within the radius.
    found: Vec<bool>,
    /// How far away it is, meters; null where there is none.
    distances_m: Vec<Option<f32>>,
    /// The voxel; null where there is none.
    #[schema(value_type = Vec<Option<VoxelIndex>>)]
    voxels: Vec<Option<[i32; 3]>>,
    /// The unit vector away from it; zero where the point is in it, or there is none.
    #[schema(value_type = Vec<Vector3>)]
    away: Vec<[f32; 3]>,
    /// The keep-outs that were met instead of a voxel, null where none was; absent where none was at all.
    #[schema(nullable = false)]
    keep_outs: Option<Vec<Option<String>>>,
    #[serde(flatten)]
    version: JsonVersion,
}

question_handler! {
    /// Finds the occupied voxel that is nearest to each point.
    find_nearest, "/v1/maps/{map}/nearest", NearestBody => NearestResponse
}

impl HttpQuestion for NearestBody {
    type Message = pb::FindNearestRequest;
    type Question = NearestQuestion;
    type Head = NearestHead;

    fn into_message(self, scope: pb::Asked, arrays: &Bytes) -> Result<pb::FindNearestRequest, ServiceError> {
        Ok(pb::FindNearestRequest {
            asked: Some(scope),
            points: Some(self.points.into_message(arrays, "points")?),
            radius_m: self.radius_m,
            to: pb::MeasuredTo::from(self.to.0).into(),
        })
    }

    fn answered(answer: AnswerOf<Self>) -> (NearestHead, Arrays) {
        let response = pb::FindNearestResponse::from(answer);
        let points = response.points;
        let voxels = Array::voxels(response.voxels_u64le, &response.found, response.keep_outs.as_ref());
        let mut arrays = vec![
            ("found", Array::Bits(response.found, points as usize)),
            ("distances_m", Array::Floats(response.distances_m_f32le)),
            ("voxels", voxels),
            ("away", Array::Vectors(response.away_f32le)),
        ];
        arrays.extend(Array::keep_outs("keep_outs", response.keep_outs));
        (NearestHead { points }, arrays)
    }
}
