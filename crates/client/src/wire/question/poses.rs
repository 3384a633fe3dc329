//! Bodies at configurations, and spheres of the map frame.

use std::sync::Arc;

use super::body::{
    answer_from, answer_of, configurations_from, counts_from, ignored_of, spheres_bytes, spheres_from,
    surroundings_from,
};
use super::scope::{Of, answered, asked_of};
use crate::wire::pb;
use crate::wire::values::{bytes_of, required};
use mrol_map::map::MapName;
use mrol_service::{AtVersion, Collisions, PoseCheck, ServiceError, SphereCheck};

impl TryFrom<pb::CheckPosesRequest> for Of<PoseCheck> {
    type Error = ServiceError;

    fn try_from(request: pb::CheckPosesRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let check = PoseCheck {
            asked,
            body: Arc::new(required(request.body, "body")?.try_into()?),
            configurations: configurations_from(&request.configurations_f32le)?,
            surroundings: surroundings_from(request.ignored, request.unknown)?,
            answer: answer_from(request.answer, request.clearance_max_m)?,
        };
        Ok((map, check))
    }
}

impl From<(&MapName, PoseCheck)> for pb::CheckPosesRequest {
    fn from((map, check): (&MapName, PoseCheck)) -> Self {
        let PoseCheck { asked, body, configurations, surroundings, answer } = check;
        let (answer, clearance_max_m) = answer_of(answer);
        Self {
            asked: Some((map, asked).into()),
            body: Some((&*body).into()),
            configurations_f32le: bytes_of(configurations),
            unknown: pb::Unknown::from(surroundings.unknown).into(),
            ignored: ignored_of(surroundings),
            answer: answer.into(),
            clearance_max_m,
        }
    }
}

impl TryFrom<pb::CheckSpheresRequest> for Of<SphereCheck> {
    type Error = ServiceError;

    fn try_from(request: pb::CheckSpheresRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let check = SphereCheck {
            asked,
            spheres: spheres_from(&request.spheres_f32le)?,
            sizes: counts_from(&request.sizes_u32le, "sizes_u32le")?,
            padding_m: request.padding_m,
            surroundings: surroundings_from(request.ignored, request.unknown)?,
            answer: answer_from(request.answer, request.clearance_max_m)?,
        };
        Ok((map, check))
    }
}

impl From<(&MapName, SphereCheck)> for pb::CheckSpheresRequest {
    fn from((map, check): (&MapName, SphereCheck)) -> Self {
        let SphereCheck { asked, spheres, sizes, padding_m, surroundings, answer } = check;
        let (answer, clearance_max_m) = answer_of(answer);
        Self {
            asked: Some((map, asked).into()),
            spheres_f32le: spheres_bytes(&spheres),
            sizes_u32le: bytes_of(sizes),
            padding_m,
            unknown: pb::Unknown::from(surroundings.unknown).into(),
            ignored: ignored_of(surroundings),
            answer: answer.into(),
            clearance_max_m,
        }
    }
}

/// Makes the conversions of a response that has collisions and a version.
macro_rules! has_collisions {
    ($($response:ident),+) => {
        $(impl From<AtVersion<Collisions>> for pb::$response {
            fn from(AtVersion { answer, version }: AtVersion<Collisions>) -> Self {
                Self { collisions: Some(answer.into()), version: Some(version.into()) }
            }
        }

        impl TryFrom<pb::$response> for AtVersion<Collisions> {
            type Error = ServiceError;

            fn try_from(response: pb::$response) -> Result<Self, ServiceError> {
                answered(required(response.collisions, "collisions")?.try_into()?, response.version)
            }
        })+
    };
}

has_collisions!(CheckPosesResponse, CheckSpheresResponse);
