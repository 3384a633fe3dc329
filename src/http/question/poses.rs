//! `POST /v1/maps/{map}/poses`: does a body fit at these configurations?

use axum::body::Bytes;

use super::answer::Arrays;
use super::body::{BodyField, CheckedHead, CheckedResponse, check_body, collisions_answered, ignored_of};
use super::form::NumbersField;
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use crate::http::forms::Object;
use crate::json::PoseNumbers;
use mrol_client::wire::pb;
use mrol_service::{PoseCheck, ServiceError};

check_body! {
    /// A body and its configurations.
    #[schema(example = json!({
        "body": {"links": [{"spheres": [[0, 0, 0, 0.2]]}]}, "configurations": [[0, 0, 1, 0, 0, 0, 1]]
    }))]
    pub(in crate::http) struct PosesBody {
        /// The body.
        #[schema(value_type = BodyField)]
        body: Object<BodyField>,
        /// A pose `[x, y, z, qx, qy, qz, qw]` for each link, link by link, configuration by configuration.
        #[schema(value_type = Vec<PoseNumbers>)]
        configurations: NumbersField<7>,
    }
}

question_handler! {
    /// Tells whether a body fits at its configurations.
    check_poses, "/v1/maps/{map}/poses", PosesBody => CheckedResponse
}

impl HttpQuestion for PosesBody {
    type Message = pb::CheckPosesRequest;
    type Question = PoseCheck;
    type Head = CheckedHead;

    fn into_message(self, scope: pb::Asked, arrays: &Bytes) -> Result<pb::CheckPosesRequest, ServiceError> {
        let Object(body) = self.body;
        Ok(pb::CheckPosesRequest {
            asked: Some(scope),
            body: Some(body.into_message(arrays)?),
            configurations_f32le: self.configurations.into_bytes(arrays, "configurations")?,
            ignored: ignored_of(self.ignored)?,
            unknown: pb::Unknown::from(self.unknown.0).into(),
            answer: pb::CheckAnswer::from(self.answer.0).into(),
            clearance_max_m: self.clearance_max_m,
        })
    }

    fn answered(answer: AnswerOf<Self>) -> (CheckedHead, Arrays) {
        collisions_answered(answer.answer)
    }
}
