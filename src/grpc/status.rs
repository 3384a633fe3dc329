//! What a failure is called in gRPC.

use tonic::{Code, Status};

use crate::telemetry::RequestOutcome;
use mrol_client::wire::{REASON, status_of};
use mrol_service::{ErrorCode, Reason, ServiceError};

/// True of a failure that concerns the stream and not one of its requests.
pub(super) fn ends_stream(error: &ServiceError) -> bool {
    error.code() == ErrorCode::Unauthenticated || error.reason == Reason::Draining
}

/// tonic's own refusal of a message in our words, any other status as it is: one that is too large names the limit, and
/// one that cannot be read (no protobuf, cut off, compressed in a way that nobody named) is the client's mistake, which
/// tonic calls an internal error. Our own failures have a reason, and are left alone.
pub(super) fn of_request(status: Status, message_bytes_max: usize) -> Status {
    let of_tonic = status.metadata().get(REASON).is_none();
    match status.code() {
        Code::OutOfRange | Code::ResourceExhausted if of_tonic => {
            let message = format!("message_bytes_max is {message_bytes_max}: {}", status.message());
            status_of(ServiceError::new(Reason::MessageTooLarge, message))
        }
        Code::Internal if of_tonic => {
            let message = format!("the message cannot be read: {}", status.message());
            status_of(ServiceError::new(Reason::BadMessage, message))
        }
        _ => status,
    }
}

/// How a call ended by `code`, with the `reason` of its metadata.
pub(super) fn outcome(code: Code, reason: Option<&[u8]>) -> RequestOutcome {
    let is_denied = matches!(code, Code::Unauthenticated | Code::PermissionDenied);
    let denial = is_denied.then(|| String::from_utf8_lossy(reason.unwrap_or(b"unknown")).into_owned().into());
    RequestOutcome { code: label(code).into(), is_ok: code == Code::Ok, denial }
}

/// A code as a metric's label.
fn label(code: Code) -> &'static str {
    match code {
        Code::Ok => "ok",
        Code::Cancelled => "cancelled",
        Code::Unknown => "unknown",
        Code::InvalidArgument => "invalid_argument",
        Code::DeadlineExceeded => "deadline_exceeded",
        Code::NotFound => "not_found",
        Code::AlreadyExists => "already_exists",
        Code::PermissionDenied => "permission_denied",
        Code::ResourceExhausted => "resource_exhausted",
        Code::FailedPrecondition => "failed_precondition",
        Code::Aborted => "aborted",
        Code::OutOfRange => "out_of_range",
        Code::Unimplemented => "unimplemented",
        Code::Internal => "internal",
        Code::Unavailable => "unavailable",
        Code::DataLoss => "data_loss",
        Code::Unauthenticated => "unauthenticated",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_keeps_its_message_and_its_word() {
        let error = ServiceError::new(Reason::GuessRequired, "no guess");
        let status = status_of(error);
        assert_eq!((status.code(), status.message()), (Code::FailedPrecondition, "no guess"));
        assert_eq!(status.metadata().get(REASON).unwrap(), "guess_required");
    }

    #[test]
    fn what_cannot_be_read_is_the_clients_mistake_and_a_defect_stays_one() {
        let unreadable = of_request(Status::internal("Unexpected EOF decoding stream."), 1);
        assert_eq!(unreadable.code(), Code::InvalidArgument);
        assert_eq!(unreadable.metadata().get(REASON).unwrap(), "bad_message");
        let defect = ServiceError::new(Reason::JobPanicked, "a defect");
        assert_eq!(of_request(status_of(defect), 1).code(), Code::Internal);
        let large = of_request(Status::out_of_range("too large"), 7);
        assert_eq!(
            (large.code(), large.message()),
            (Code::ResourceExhausted, "message_bytes_max is 7: too large")
        );
    }
}
