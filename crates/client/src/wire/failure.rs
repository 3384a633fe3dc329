//! Failures as messages and as status, and their codes.

use std::time::Duration;

use tonic::metadata::MetadataValue;
use tonic::{Code, Status};

use super::pb;
use mrol_service::{ErrorCode, ServiceError};

/// The metadata that holds the word for programs.
pub const REASON: &str = "mrol-reason";

/// The metadata that holds the gRPC addresses of the nodes that hold a map which this one does not, with commas between
/// them: the first is the best.
const ELSEWHERE: &str = "mrol-elsewhere";

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
    let addresses: Vec<&str> = error.holders.iter().map(|holder| holder.grpc.as_str()).collect();
    if let Some(addresses) = (!addresses.is_empty()).then(|| addresses.join(",").parse().ok()).flatten() {
        status.metadata_mut().insert(ELSEWHERE, addresses);
    }
    status
}

/// The gRPC addresses of the nodes that a status says are to be asked instead; none where it names none.
pub fn elsewhere(status: &Status) -> Vec<String> {
    let named = status.metadata().get(ELSEWHERE).and_then(|named| named.to_str().ok());
    named.into_iter().flat_map(|named| named.split(',')).map(|address| address.trim().to_owned()).collect()
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
            elsewhere: error.holders.into_iter().map(|holder| holder.grpc).collect(),
            message: error.message,
        }
    }
}
