//! Failures: a code, a word and a sentence.

use std::ffi::CStr;

use mrol_client::service::{ErrorCode, Reason, ServiceError};
use mrol_client::{ClientError, ReplicaError};

/// What became of a call: `mrol_code`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum Code {
    /// It succeeded.
    Ok = 0,
    /// An argument is wrong.
    InvalidArgument = 1,
    /// The replica is not open.
    Closed = 2,
    /// The replica is another process's.
    Forked = 3,
    /// No server can be reached, or trusted.
    Unreachable = 4,
    /// The server refused.
    Refused = 5,
    /// It did not come in time.
    Timeout = 6,
    /// The map is larger than allowed.
    TooLarge = 7,
    /// The server's messages make no sense.
    Damaged = 8,
    /// A defect of the library.
    Internal = 9,
    /// The copy is older than allowed.
    Stale = 10,
}

impl Code {
    /// All of them, in the order of their numbers.
    pub(crate) const ALL: &'static [Self] = &[
        Self::Ok,
        Self::InvalidArgument,
        Self::Closed,
        Self::Forked,
        Self::Unreachable,
        Self::Refused,
        Self::Timeout,
        Self::TooLarge,
        Self::Damaged,
        Self::Internal,
        Self::Stale,
    ];

    /// The code of a number.
    pub(crate) fn of(number: i32) -> Option<Self> {
        usize::try_from(number).ok().and_then(|number| Self::ALL.get(number)).copied()
    }

    /// Its name in mrol.h.
    pub(crate) fn name(self) -> &'static CStr {
        match self {
            Self::Ok => c"MROL_OK",
            Self::InvalidArgument => c"MROL_INVALID_ARGUMENT",
            Self::Closed => c"MROL_CLOSED",
            Self::Forked => c"MROL_FORKED",
            Self::Unreachable => c"MROL_UNREACHABLE",
            Self::Refused => c"MROL_REFUSED",
            Self::Timeout => c"MROL_TIMEOUT",
            Self::TooLarge => c"MROL_TOO_LARGE",
            Self::Damaged => c"MROL_DAMAGED",
            Self::Internal => c"MROL_INTERNAL",
            Self::Stale => c"MROL_STALE",
        }
    }
}

/// Why a call fails.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Failure {
    /// What kind of failure it is.
    pub(crate) code: Code,
    /// The reason as a word; empty where there is none.
    pub(crate) reason: String,
    /// A sentence for people.
    pub(crate) message: String,
}

impl Failure {
    fn new(code: Code, reason: &str, message: impl Into<String>) -> Self {
        Self { code, reason: reason.to_owned(), message: message.into() }
    }

    /// An argument is wrong: the message names it, its value and its limit.
    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Self::new(Code::InvalidArgument, "", message)
    }

    /// The failure of something that is part of what is named.
    pub(crate) fn of(self, name: &str) -> Self {
        Self { message: format!("{name}: {}", self.message), ..self }
    }

    /// The replica is not open.
    pub(crate) fn closed() -> Self {
        Self::new(Code::Closed, "", "the replica is not open: it never was, or it is closed")
    }

    /// The connection is not open.
    pub(crate) fn client_closed() -> Self {
        Self::new(Code::Closed, "", "the client is not open: it never was, or it is closed")
    }

    /// The server did not answer in time.
    pub(crate) fn no_answer(timeout: std::time::Duration) -> Self {
        let message = format!("timeout_ms is {}: the server had not answered by then", timeout.as_millis());
        Self::new(Code::Timeout, "", message)
    }

    /// The body is none.
    pub(crate) fn no_body() -> Self {
        Self::argument("body is none: it was never made, or it was freed")
    }

    /// The replica belongs to the process that forked this one.
    pub(crate) fn forked() -> Self {
        Self::new(Code::Forked, "", "the library is in use in the process that forked this one")
    }

    /// The copy was not complete in time.
    pub(crate) fn too_slow(timeout: std::time::Duration) -> Self {
        let message =
            format!("open_timeout_ms is {}: the copy was not complete by then", timeout.as_millis());
        Self::new(Code::Timeout, "", message)
    }

    /// The system does not give what the library needs.
    pub(crate) fn no_threads(error: &std::io::Error) -> Self {
        Self::new(Code::Internal, "", format!("no thread can be started: {error}"))
    }

    /// A function panicked.
    pub(crate) fn panicked() -> Self {
        Self::new(Code::Internal, "", "a defect of the library: it panicked")
    }
}

impl From<ServiceError> for Failure {
    fn from(error: ServiceError) -> Self {
        let code = match error.code() {
            ErrorCode::DeadlineExceeded => Code::Timeout,
            ErrorCode::Internal => Code::Internal,
            _ if error.reason == Reason::ReplicaStale => Code::Stale,
            _ => Code::InvalidArgument,
        };
        Self::new(code, error.reason.as_str(), error.message)
    }
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        let code = match &error {
            ClientError::Url { .. } | ClientError::Credentials(_) => Code::InvalidArgument,
            ClientError::Unreachable { .. } | ClientError::Untrusted { .. } | ClientError::Lost { .. } => {
                Code::Unreachable
            }
            ClientError::Refused { .. } => Code::Refused,
            ClientError::Foreign { .. } | ClientError::Answer(_) => Code::Damaged,
        };
        let message = match &error {
            // The address is not told: where it is none, it may be a key.
            ClientError::Url { problem, .. } => {
                format!(
                    "options.address is no server address: {problem}; it looks like http://127.0.0.1:7334"
                )
            }
            // The reason has a place of its own.
            ClientError::Refused { message, .. } => message.clone(),
            error => error.to_string(),
        };
        Self::new(code, error.reason().unwrap_or_default(), message)
    }
}

impl From<ReplicaError> for Failure {
    fn from(error: ReplicaError) -> Self {
        let code = match error {
            ReplicaError::Client(error) => return error.into(),
            ReplicaError::Question(error) => return error.into(),
            ReplicaError::Damaged(_) | ReplicaError::Diverged { .. } => Code::Damaged,
            ReplicaError::Silent(_) => Code::Timeout,
            ReplicaError::TooLarge(_) | ReplicaError::TooManyViewpoints(_) => Code::TooLarge,
        };
        Self::new(code, "", error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_its_code_or_none() {
        for (number, code) in Code::ALL.iter().enumerate() {
            assert_eq!((*code as usize, Code::of(number as i32)), (number, Some(*code)));
        }
        for number in [-1, Code::ALL.len() as i32, i32::MIN, i32::MAX] {
            assert_eq!(Code::of(number), None);
        }
    }
}
