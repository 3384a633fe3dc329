//! `POST /v1/maps/{map}/motions`: can a body move along these configurations?

use axum::body::Bytes;
use serde::Serialize;
use utoipa::ToSchema;

use super::answer::{Array, Arrays};
use super::body::{BodyField, DescribedIgnored, IgnoredList, ignored_of};
use super::form::{CountsField, NumbersField};
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use super::scope::question_body;
use crate::http::forms::Object;
use crate::json::described;
use crate::json::{ByKeyword, JsonVersion, PoseNumbers};
use mrol_client::wire::pb;
use mrol_map::planning::Unknown;
use mrol_service::{MotionCheck, ServiceError};

question_body! {
    /// A body and its motions.
    #[schema(example = json!({
        "body": {"links": [{"spheres": [[0, 0, 0, 0.2]]}]},
        "configurations": [[0, 0, 1, 0, 0, 0, 1], [0.5, 0, 1, 0, 0, 0, 1]], "lengths": [2]
    }))]
    pub(in crate::http) struct MotionsBody {
        /// The body.
        #[schema(value_type = BodyField)]
        body: Object<BodyField>,
        /// A pose `[x, y, z, qx, qy, qz, qw]` for each link, link by link, configuration by configuration, motion
        /// by motion.
        #[schema(value_type = Vec<PoseNumbers>)]
        configurations: NumbersField<7>,
        /// How many configurations each motion has.
        #[schema(value_type = Vec<u32>)]
        lengths: CountsField,
        /// How far a point of the body moves from one check to the next, at most, meters; half a voxel without.
        step_m: Option<f32>,
        /// How far clearances are told, meters; they are not told without.
        clearance_max_m: Option<f32>,
        /// Regions in which voxels do not count; 64 at most.
        #[schema(value_type = Vec<DescribedIgnored>, required = false)]
        #[serde(default)]
        ignored: IgnoredList,
        /// What voxels are that no scan saw through: free or occupied; `free` without.
        #[schema(value_type = described::Unknown, required = false)]
        #[serde(default)]
        unknown: ByKeyword<Unknown>,
    }
}

/// What is told of motions as numbers.
#[derive(Serialize, ToSchema)]
pub(in crate::http) struct MotionsHead {
    /// How many motions were checked.
    motions: u64,
    /// How many of them are free.
    free_count: u64,
}

/// Whether motions are free.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct MotionsResponse {
    #[serde(flatten)]
    head: MotionsHead,
    /// Whether the body meets nothing on its way.
    free: Vec<bool>,
    /// Where it first meets something, as a share of the motion; null where it is free.
    first_hits: Vec<Option<f32>>,
    /// The least distance along the way, meters, where that is asked for.
    #[schema(nullable = false)]
    clearances_m: Option<Vec<Option<f32>>>,
    #[serde(flatten)]
    version: JsonVersion,
}

question_handler! {
    /// Tells whether a body can move along its motions.
    check_motions, "/v1/maps/{map}/motions", MotionsBody => MotionsResponse
}

impl HttpQuestion for MotionsBody {
    type Message = pb::CheckMotionsRequest;
    type Question = MotionCheck;
    type Head = MotionsHead;

    fn into_message(self, scope: pb::Asked, arrays: &Bytes) -> Result<pb::CheckMotionsRequest, ServiceError> {
        let Object(body) = self.body;
        Ok(pb::CheckMotionsRequest {
            asked: Some(scope),
            body: Some(body.into_message(arrays)?),
            configurations_f32le: self.configurations.into_bytes(arrays, "configurations")?,
            lengths_u32le: self.lengths.into_bytes(arrays, "lengths")?,
            step_m: self.step_m,
            clearance_max_m: self.clearance_max_m,
            ignored: ignored_of(self.ignored)?,
            unknown: pb::Unknown::from(self.unknown.0).into(),
        })
    }

    fn answered(answer: AnswerOf<Self>) -> (MotionsHead, Arrays) {
        let response = pb::CheckMotionsResponse::from(answer);
        let pb::CheckMotionsResponse { motions, free_count, .. } = response;
        let mut arrays = vec![
            ("free", Array::Bits(response.free, motions as usize)),
            ("first_hits", Array::Floats(response.first_hits_f32le)),
        ];
        if !response.clearances_m_f32le.is_empty() {
            arrays.push(("clearances_m", Array::Floats(response.clearances_m_f32le)));
        }
        (MotionsHead { motions, free_count }, arrays)
    }
}
