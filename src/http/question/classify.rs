//! `POST /v1/maps/{map}/classification`: points as what is known of them.

use axum::body::Bytes;
use serde::Serialize;
use utoipa::ToSchema;

use super::answer::{Array, Arrays};
use super::form::PointsField;
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use super::scope::question_body;
use crate::http::forms::JsonPoints;
use crate::json::JsonVersion;
use mrol_client::wire::pb;
use mrol_service::{ClassifyQuestion, ServiceError};

question_body! {
    /// Points of which it is asked what is known.
    #[schema(example = json!({"points": [[1, 1, 0.5], [0, 0, 1]]}))]
    pub(in crate::http) struct ClassifyBody {
        /// The points.
        #[schema(value_type = JsonPoints)]
        points: PointsField,
    }
}

/// What is told of classified points as numbers.
#[derive(Serialize, ToSchema)]
pub(in crate::http) struct ClassifiedHead {
    /// How many points were asked about.
    points: u64,
    /// How many are occupied.
    points_occupied: u64,
    /// How many are free.
    points_free: u64,
}

/// What is known of points.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct ClassifiedResponse {
    #[serde(flatten)]
    head: ClassifiedHead,
    /// Whether each is occupied.
    occupied: Vec<bool>,
    /// Whether a scan saw through its voxel, and it is not occupied.
    free: Vec<bool>,
    #[serde(flatten)]
    version: JsonVersion,
}

question_handler! {
    /// Tells which points are occupied and which are free: what is neither is unknown.
    classify_points, "/v1/maps/{map}/classification", ClassifyBody => ClassifiedResponse
}

impl HttpQuestion for ClassifyBody {
    type Message = pb::ClassifyPointsRequest;
    type Question = ClassifyQuestion;
    type Head = ClassifiedHead;

    fn into_message(self, scope: pb::Asked, arrays: &Bytes) -> Result<Self::Message, ServiceError> {
        let points = Some(self.points.into_message(arrays, "points")?);
        Ok(pb::ClassifyPointsRequest { asked: Some(scope), points })
    }

    fn answered(answer: AnswerOf<Self>) -> (ClassifiedHead, Arrays) {
        let response = pb::ClassifyPointsResponse::from(answer);
        let pb::ClassifyPointsResponse { points, points_occupied, points_free, .. } = response;
        let arrays = vec![
            ("occupied", Array::Bits(response.occupied, points as usize)),
            ("free", Array::Bits(response.free, points as usize)),
        ];
        (ClassifiedHead { points, points_occupied, points_free }, arrays)
    }
}
