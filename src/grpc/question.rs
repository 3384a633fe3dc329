//! Questions of planners: each as one call, and as a stream of them.

use prost::Message;
use tonic::{Request, Response, Status, Streaming};

use super::stream::{self, Answers, same_map};
use super::{Adapter, answered, service_of};
use crate::access::Operation;
use crate::map::MapName;
use crate::service::{Answered, Question, ServiceError};
use crate::wire::pb;

impl Adapter {
    /// Answers one question.
    pub(super) async fn ask<Q, M, A>(&self, request: Request<M>) -> Result<Response<A>, Status>
    where
        Q: Question,
        M: Message,
        (MapName, Q): TryFrom<M, Error = ServiceError>,
        A: Message + From<Answered<Q::Answer>>,
    {
        let service = service_of(&request)?;
        let (map, question) = <(MapName, Q)>::try_from(request.into_inner())?;
        Ok(answered(service.ask(&map, question).await?.into()))
    }

    /// Answers questions in order, each at one revision of its own; one that fails ends the stream.
    pub(super) fn ask_in_order<Q, M, A>(
        &self,
        operation: Operation,
        requests: Request<Streaming<M>>,
    ) -> Result<Response<Answers<A>>, Status>
    where
        Q: Question,
        M: stream::Message,
        (MapName, Q): TryFrom<M, Error = ServiceError>,
        A: Message + From<Answered<Q::Answer>> + 'static,
    {
        let answers = self.answer_in_order(operation, requests, None, |service, request| async move {
            let (map, question) = <(MapName, Q)>::try_from(request)?;
            Ok(service.ask(&map, question).await?.into())
        })?;
        Ok(Response::new(answers))
    }
}

impl stream::Message for pb::CastRaysRequest {
    type Former = String;

    fn complete(&mut self, former: &mut String) {
        same_map(&mut self.asked.get_or_insert_default().map, former);
    }
}

impl stream::Message for pb::FindNearestRequest {
    type Former = String;

    fn complete(&mut self, former: &mut String) {
        same_map(&mut self.asked.get_or_insert_default().map, former);
    }
}

impl stream::Message for pb::CheckSpheresRequest {
    type Former = String;

    fn complete(&mut self, former: &mut String) {
        same_map(&mut self.asked.get_or_insert_default().map, former);
    }
}

impl stream::Message for pb::CheckPosesRequest {
    type Former = (String, Option<pb::Body>);

    fn complete(&mut self, (map, body): &mut Self::Former) {
        same_map(&mut self.asked.get_or_insert_default().map, map);
        same_body(&mut self.body, body);
    }
}

impl stream::Message for pb::CheckMotionsRequest {
    type Former = (String, Option<pb::Body>);

    fn complete(&mut self, (map, body): &mut Self::Former) {
        same_map(&mut self.asked.get_or_insert_default().map, map);
        same_body(&mut self.body, body);
    }
}

/// The body of a request, or that of the request before. Its arrays are shared, not copied.
fn same_body(body: &mut Option<pb::Body>, former: &mut Option<pb::Body>) {
    if body.is_none() { body.clone_from(former) } else { former.clone_from(body) }
}
