//! Failures as messages, and their codes.

use tonic::Code;

use super::pb;
use crate::service::{ErrorCode, ServiceError};

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
