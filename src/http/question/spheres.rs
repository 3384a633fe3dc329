//! `POST /v1/maps/{map}/spheres`: do these spheres of the map frame meet voxels?

use axum::body::Bytes;

use super::answer::Arrays;
use super::body::{CheckedHead, CheckedResponse, check_body, collisions_answered, ignored_of};
use super::form::{CountsField, NumbersField};
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use crate::json::Sphere;
use mrol_client::wire::pb;
use mrol_service::{ServiceError, SphereCheck};

check_body! {
    /// Spheres of the map frame.
    #[schema(example = json!({"spheres": [[1, 1, 0.5, 0.2]], "answer": "first_hit"}))]
    pub(in crate::http) struct SpheresBody {
        /// Spheres `[x, y, z, radius]` in the map frame, meters.
        #[schema(value_type = Vec<Sphere>)]
        spheres: NumbersField<4>,
        /// How many spheres each group has; one each without.
        #[schema(value_type = Option<Vec<u32>>)]
        sizes: Option<CountsField>,
        /// What every radius grows by, meters; 0 without.
        #[serde(default)]
        padding_m: f32,
    }
}

question_handler! {
    /// Tells whether spheres of the map frame meet voxels.
    check_spheres, "/v1/maps/{map}/spheres", SpheresBody => CheckedResponse
}

impl HttpQuestion for SpheresBody {
    type Message = pb::CheckSpheresRequest;
    type Question = SphereCheck;
    type Head = CheckedHead;

    fn into_message(self, scope: pb::Asked, arrays: &Bytes) -> Result<pb::CheckSpheresRequest, ServiceError> {
        let spheres = self.spheres.into_bytes(arrays, "spheres")?;
        let sizes = match self.sizes {
            Some(sizes) => sizes.into_bytes(arrays, "sizes")?,
            None => CountsField::ones(spheres.len() / SPHERE_BYTES),
        };
        Ok(pb::CheckSpheresRequest {
            asked: Some(scope),
            spheres_f32le: spheres,
            sizes_u32le: sizes,
            padding_m: self.padding_m,
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

/// Bytes of a sphere.
const SPHERE_BYTES: usize = 4 * size_of::<f32>();
