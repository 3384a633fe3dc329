//! `POST /v1/maps/{map}/rays`: what each ray meets first.

use axum::body::Bytes;
use serde::Serialize;
use utoipa::ToSchema;

use super::answer::{Array, Arrays};
use super::form::PointsField;
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use super::scope::question_body;
use crate::http::forms::JsonPoints;
use crate::json::described;
use crate::json::{ByKeyword, JsonVersion, VoxelIndex};
use mrol_client::wire::pb;
use mrol_map::planning::Unknown;
use mrol_service::{RayQuestion, ServiceError};

question_body! {
    /// Rays: their origins, and directions or ends.
    #[schema(example = json!({"origins": [[0, 0, 1]], "directions": [[1, 0, 0]], "range_m": 10}))]
    pub(in crate::http) struct RaysBody {
        /// Where the rays begin: one point for all, or one each.
        #[schema(value_type = JsonPoints)]
        origins: PointsField,
        /// Unit vectors along them; together with `range_m`.
        #[schema(value_type = Option<JsonPoints>)]
        directions: Option<PointsField>,
        /// Where they end, in the place of `directions`.
        #[schema(value_type = Option<JsonPoints>)]
        ends: Option<PointsField>,
        /// How far the rays reach, meters.
        range_m: Option<f64>,
        /// What voxels are that no scan saw through: free or occupied; `free` without.
        #[schema(value_type = described::Unknown, required = false)]
        #[serde(default)]
        unknown: ByKeyword<Unknown>,
    }
}

/// What is told of rays as numbers.
#[derive(Serialize, ToSchema)]
pub(in crate::http) struct RaysHead {
    /// How many rays were cast.
    rays: u64,
    /// How many of them met something.
    hits: u64,
}

/// What each ray meets first.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct RaysResponse {
    #[serde(flatten)]
    head: RaysHead,
    /// Whether it meets something.
    hit: Vec<bool>,
    /// How far away, meters; null where it meets nothing.
    distances_m: Vec<Option<f32>>,
    /// The voxel; null where it meets none.
    #[schema(value_type = Vec<Option<VoxelIndex>>)]
    voxels: Vec<Option<[i32; 3]>>,
    /// The keep-outs that were met instead of a voxel, null where none was; absent where none was at all.
    #[schema(nullable = false)]
    keep_outs: Option<Vec<Option<String>>>,
    #[serde(flatten)]
    version: JsonVersion,
}

question_handler! {
    /// Tells what each ray meets first.
    cast_rays, "/v1/maps/{map}/rays", RaysBody => RaysResponse
}

impl HttpQuestion for RaysBody {
    type Message = pb::CastRaysRequest;
    type Question = RayQuestion;
    type Head = RaysHead;

    fn into_message(self, scope: pb::Asked, arrays: &Bytes) -> Result<pb::CastRaysRequest, ServiceError> {
        let points =
            |field: Option<PointsField>, name| field.map(|of| of.into_message(arrays, name)).transpose();
        Ok(pb::CastRaysRequest {
            asked: Some(scope),
            origins: points(Some(self.origins), "origins")?,
            directions: points(self.directions, "directions")?,
            ends: points(self.ends, "ends")?,
            range_m: self.range_m,
            unknown: pb::Unknown::from(self.unknown.0).into(),
        })
    }

    fn answered(answer: AnswerOf<Self>) -> (RaysHead, Arrays) {
        let response = pb::CastRaysResponse::from(answer);
        let pb::CastRaysResponse { rays, hits, .. } = response;
        let voxels = Array::voxels(response.voxels_u64le, &response.hit, response.keep_outs.as_ref());
        let mut arrays = vec![
            ("hit", Array::Bits(response.hit, rays as usize)),
            ("distances_m", Array::Floats(response.distances_m_f32le)),
            ("voxels", voxels),
        ];
        arrays.extend(Array::keep_outs("keep_outs", response.keep_outs));
        (RaysHead { rays, hits }, arrays)
    }
}
