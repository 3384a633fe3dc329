//! Failures as messages and as status, and their codes.

use std::time::Duration;

use tonic::metadata::MetadataValue;
use tonic::{Code, Status};

use super::pb;
use mrol_service::{ErrorCode, ServiceError};

/// The metadata that holds the word for programs.
pub const REASON: &str = "mrol-reason";

/// The metadata that tells gRPC's own retries how many milliseconds to wait.
const PUSHBACK: &str = "grpc-retry-pushback-ms";

/// The gRPC code of a failure.
pub fn status_code(code: ErrorCode) -> Code {
    match code {
        ErrorCode::InvalidArgument => Code::InvalidArgument,
        ErrorCode::Unauthenticated => Code::Unauthenticated,
        ErrorCode::PermissionDenied => Code::PermissionDenied,
        ErrorCode::NotFound => Code::NotFound,
        ErrorCode::Conflict => Code::AlreadyExists,
        ErrorCode::FailedPrecondition => Code::FailedPrecondition,
        ErrorCode::ResourceExhausted => Code::ResourceExhausted,
        ErrorCode::DeadlineExceeded => Code::DeadlineExceeded,
        ErrorCode::Unavailable => Code::Unavailable,
        ErrorCode::Internal => Code::Internal,
    }
}

/// A failure as what ends a call.
pub fn status_of(error: ServiceError) -> Status {
    let mut status = Status::new(status_code(error.code()), error.message);
    status.metadata_mut().insert(REASON, MetadataValue::from_static(error.reason.as_str()));
    if let Some(wait) = error.retry_after {
        status.metadata_mut().insert(PUSHBACK, MetadataValue::from(wait.as_millis() as u64));
    }
    status
}

/// When a status says that the same call may be answered otherwise.
pub fn retry_after(status: &Status) -> Option<Duration> {
    let wait = status.metadata().get(PUSHBACK)?.to_str().ok()?;
    wait.parse().ok().map(Duration::from_millis)
}

/// A failure as an answer of a stream.
impl From<ServiceError> for pb::Failure {
    fn from(error: ServiceError) -> Self {
        Self {
            code: status_code(error.code()) as i32,
            reason: error.reason.as_str().to_owned(),
            retry_after_s: error.retry_after.map(|wait| wait.as_secs_f64()),
            message: error.message,
        }
    }
}
