//! Questions of planners and their answers (`planning.proto`).

mod body;
mod classify;
mod frontiers;
mod grid;
mod keep_outs;
mod motions;
mod nearest;
mod poses;
mod rays;

use super::{InField, pb, required, uuid_from};
use mrol_map::map::MapName;
use mrol_service::Limits;
use mrol_service::{Answered, Asked, MapVersion, ServiceError};

/// A question with the map that it is about.
pub(super) type Of<Q> = (MapName, Q);

/// A message that asks a question.
pub trait QuestionMessage: prost::Message {
    /// The body that it asks about, where it does.
    fn body(&self) -> Option<&pb::Body> {
        None
    }

    /// The regions in which voxels do not count, where it has some.
    fn ignored(&self) -> Option<&Vec<pb::Region>> {
        None
    }

    /// Bytes of memory that it takes: those that it came in, which its arrays share, and its lists.
    fn memory_bytes(&self) -> usize {
        let links = self.body().map_or(0, |body| body.links.capacity() * size_of::<pb::Link>());
        let ignored = self.ignored().map_or(0, |ignored| ignored.capacity() * size_of::<pb::Region>());
        self.encoded_len() + links + ignored
    }
}

/// The question of a message, with the map that it is about. Of a body of more parts than may be, nothing is made.
pub fn question_of<M: QuestionMessage, Q>(message: M, limits: &Limits) -> Result<Of<Q>, ServiceError>
where
    Of<Q>: TryFrom<M, Error = ServiceError>,
{
    message.body().map_or(Ok(()), |body| check_body(body, limits))?;
    message.try_into()
}

/// Refuses a body of more parts than may be.
pub fn check_body(body: &pb::Body, limits: &Limits) -> Result<(), ServiceError> {
    limits.check_body_parts(body.parts())
}

/// Says of messages that they ask a question about no body.
macro_rules! asks_without_a_body {
    ($($request:ident),+) => {
        $(impl QuestionMessage for pb::$request {})+
    };
}

/// Says of messages that they ask a question about a body.
macro_rules! asks_about_a_body {
    ($($request:ident),+) => {
        $(impl QuestionMessage for pb::$request {
            fn body(&self) -> Option<&pb::Body> {
                self.body.as_ref()
            }

            fn ignored(&self) -> Option<&Vec<pb::Region>> {
                Some(&self.ignored)
            }
        })+
    };
}

asks_without_a_body!(
    CastRaysRequest,
    FindNearestRequest,
    ClassifyPointsRequest,
    ListFrontiersRequest,
    ProjectGridRequest
);
asks_about_a_body!(CheckPosesRequest, CheckMotionsRequest);

impl QuestionMessage for pb::CheckSpheresRequest {
    fn ignored(&self) -> Option<&Vec<pb::Region>> {
        Some(&self.ignored)
    }
}

impl TryFrom<pb::Asked> for Of<Asked> {
    type Error = ServiceError;

    fn try_from(asked: pb::Asked) -> Result<Self, ServiceError> {
        let pb::Asked { map, level, min_revision, map_uuid, ignore_keep_outs } = asked;
        let map_uuid = (!map_uuid.is_empty()).then(|| uuid_from(&map_uuid)).transpose()?;
        Ok((MapName::new(&map)?, Asked { level, min_revision, map_uuid, ignore_keep_outs }))
    }
}

impl From<(&MapName, Asked)> for pb::Asked {
    fn from((map, asked): (&MapName, Asked)) -> Self {
        let Asked { level, min_revision, map_uuid, ignore_keep_outs } = asked;
        let map_uuid = map_uuid.map(|uuid| uuid.to_string()).unwrap_or_default();
        Self { map: map.to_string(), level, min_revision, map_uuid, ignore_keep_outs }
    }
}

/// What a question has in common with others.
fn asked_of(asked: Option<pb::Asked>) -> Result<Of<Asked>, ServiceError> {
    required(asked, "asked")?.try_into()
}

/// An answer with its version, which the message must name.
fn answered<A>(answer: A, version: Option<pb::MapVersion>) -> Result<Answered<A>, ServiceError> {
    let version: MapVersion = required(version, "version")?.try_into().in_field("version")?;
    Ok(Answered { answer, version })
}
