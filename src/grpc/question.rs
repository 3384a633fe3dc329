//! Questions of planners: each as one call, and as a stream of them.

use prost::Message;
use tonic::{Request, Response, Status, Streaming};

use super::adapter::{Adapter, answered, service_of};
use super::former::{FormerBody, Keeping, same_map};
use super::stream;
use super::stream::{Answers, Counted};
use crate::access::Operation;
use crate::admission::{InboundBody, off_runtime};
use mrol_client::wire::{QuestionMessage, parse_question, pb, status_of};
use mrol_map::map::MapName;
use mrol_service::{AtVersion, MapService, Question, ServiceError};

impl Adapter {
    /// Answers one question.
    pub(super) async fn ask<Q, M, A>(&self, request: Request<M>) -> Result<Response<A>, Status>
    where
        Q: Question,
        M: Message + QuestionMessage + 'static,
        (MapName, Q): TryFrom<M, Error = ServiceError>,
        A: Message + From<AtVersion<Q::Answer>>,
    {
        let service = service_of(&request).map_err(status_of)?;
        let arrival = InboundBody::of(request.extensions()).map_err(status_of)?.clone();
        arrival.at_least(request.get_ref().memory_bytes()).map_err(status_of)?;
        let (map, question) =
            question::<Q, _, _>(&service, request.into_inner(), arrival).await.map_err(status_of)?;
        Ok(answered(service.ask(&map, question).await.map_err(status_of)?.into()))
    }

    /// Answers questions in order, each at one revision of its own; one that fails ends the stream.
    pub(super) fn ask_in_order<Q, M, A>(
        &self,
        operation: Operation,
        requests: Request<Streaming<M>>,
    ) -> Result<Response<Answers<A>>, Status>
    where
        Q: Question,
        M: stream::Message + QuestionMessage,
        (MapName, Q): TryFrom<M, Error = ServiceError>,
        A: Message + From<AtVersion<Q::Answer>> + 'static,
    {
        let ask = |service: MapService, request: M, counted: Counted| async move {
            let (map, question) = question::<Q, _, _>(&service, request, counted).await?;
            Ok(service.ask(&map, question).await?.into())
        };
        let answers = self.answer_in_order(operation, requests, None, ask)?;
        Ok(Response::new(answers))
    }
}

/// The question of a message of a call or a stream, whose memory `counted` counts.
async fn question<Q, M, C>(service: &MapService, message: M, counted: C) -> Result<(MapName, Q), ServiceError>
where
    Q: Question,
    M: Message + QuestionMessage + 'static,
    (MapName, Q): TryFrom<M, Error = ServiceError>,
    C: Send + 'static,
{
    let (bytes, of_limits) = (message.encoded_len(), service.clone());
    off_runtime(service, bytes, counted, move || parse_question(message, of_limits.limits())).await?
}

/// Makes messages of streams of requests that may leave out their map.
macro_rules! streamed {
    ($($request:ident),+) => {
        $(impl stream::Message for pb::$request {
            type Former = String;

            fn memory_bytes(&self) -> usize {
                QuestionMessage::memory_bytes(self)
            }

            fn complete(&mut self, former: &mut String, _: Keeping<'_>) -> Result<(), ServiceError> {
                same_map(&mut self.asked.get_or_insert_default().map, former);
                Ok(())
            }
        })+
    };
}

/// Makes messages of streams of requests that may leave out their map and their body.
macro_rules! streamed_with_a_body {
    ($($request:ident),+) => {
        $(impl stream::Message for pb::$request {
            type Former = (String, FormerBody);

            fn memory_bytes(&self) -> usize {
                QuestionMessage::memory_bytes(self)
            }

            fn complete(
                &mut self,
                (map, body): &mut Self::Former,
                keeping: Keeping<'_>,
            ) -> Result<(), ServiceError> {
                same_map(&mut self.asked.get_or_insert_default().map, map);
                body.complete(&mut self.body, keeping)
            }
        })+
    };
}

streamed!(CastRaysRequest, FindNearestRequest, ClassifyPointsRequest, CheckSpheresRequest);
streamed_with_a_body!(CheckPosesRequest, CheckMotionsRequest);
