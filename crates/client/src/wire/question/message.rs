//! Messages that ask a question: the body and the regions that they name, and the question that each makes.

use super::scope::Of;
use crate::wire::pb;
use mrol_service::{Limits, ServiceError};

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
pub fn parse_question<M: QuestionMessage, Q>(message: M, limits: &Limits) -> Result<Of<Q>, ServiceError>
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
