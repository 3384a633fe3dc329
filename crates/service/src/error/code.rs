//! Kinds of failure.

/// The kinds of failure that a caller acts on differently; each protocol maps them in one place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorCode {
    /// The request can never succeed as it is.
    InvalidArgument,
    /// The caller has no key, or none that is known.
    Unauthenticated,
    /// The caller's key is not for this; `reason` says what is missing.
    PermissionDenied,
    /// No such map.
    NotFound,
    /// What was to be made exists already and is not the same.
    Conflict,
    /// The state of the map does not allow it; `reason` says which.
    FailedPrecondition,
    /// A limit of the server, not of the request: try later, or less at once.
    ResourceExhausted,
    /// The request's time was up.
    DeadlineExceeded,
    /// The server is going down, or cannot serve now.
    Unavailable,
    /// A defect of the server.
    Internal,
}

impl ErrorCode {
    /// The code as a word: `not_found`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::InvalidArgument => "invalid_argument",
            Self::Unauthenticated => "unauthenticated",
            Self::PermissionDenied => "permission_denied",
            Self::NotFound => "not_found",
            Self::Conflict => "conflict",
            Self::FailedPrecondition => "failed_precondition",
            Self::ResourceExhausted => "resource_exhausted",
            Self::DeadlineExceeded => "deadline_exceeded",
            Self::Unavailable => "unavailable",
            Self::Internal => "internal",
        }
    }
}
