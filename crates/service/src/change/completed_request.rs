//! A change that was asked for twice under one request id.

use crate::commit::Refusal;
use crate::error::{Reason, ServiceError};
use crate::maps::HostedMap;
use mrol_map::map::{CompletedRequest, Request, RequestKind};

impl HostedMap {
    /// What came of a request the first time.
    pub(super) fn answered(
        &self,
        kind: RequestKind,
        request: Option<&Request>,
        former_digest: u64,
    ) -> Result<Option<CompletedRequest>, ServiceError> {
        let Some(request) = request else {
            return Ok(None);
        };
        match self.map.requests().find(kind, &request.id, request.caller.as_ref()) {
            Some(answered) if ![request.digest, former_digest].contains(&answered.digest) => {
                let message = format!(
                    "request_id {} was accepted at revision {} with other content: name new requests anew",
                    request.id, answered.revision
                );
                Err(ServiceError::new(Reason::RequestIdTaken, message))
            }
            answered => Ok(answered.cloned()),
        }
    }

    /// Refuses or answers a request that came twice, where the other one was first.
    pub(super) fn still_unanswered(
        &self,
        kind: RequestKind,
        request: Option<&Request>,
        former_digest: u64,
    ) -> Result<(), Refusal> {
        if self.answered(kind, request, former_digest)?.is_some() { Err(Refusal::Stale) } else { Ok(()) }
    }
}
