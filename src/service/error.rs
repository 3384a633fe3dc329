//! What can go wrong with a request, once for every protocol.

use std::time::Duration;

use crate::bloom::FilterSettingsError;
use crate::geometry::PoseError;
use crate::map::{MapSettingsError, NameError, RegionError};
use crate::voxel::SettingError;

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
    /// It exists already and is not the same.
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

/// A failed request: nothing was changed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ServiceError {
    /// What kind of failure.
    pub code: ErrorCode,
    /// A word for programs, stable: `guess_required`, `map_not_found`, ...
    pub reason: &'static str,
    /// A sentence for people: the field, its value and the limit, in lower case.
    pub message: String,
    /// When the same request may be answered otherwise, where the server can tell.
    pub retry_after: Option<Duration>,
}

impl ServiceError {
    /// A failure of kind `code`.
    pub fn new(code: ErrorCode, reason: &'static str, message: impl Into<String>) -> Self {
        Self { code, reason, message: message.into(), retry_after: None }
    }

    /// The server has too much to do: a limit, named in the message, would be exceeded.
    pub fn overloaded(message: impl Into<String>) -> Self {
        Self::new(ErrorCode::ResourceExhausted, "overloaded", message).retry_after(Duration::from_secs(1))
    }

    /// The same, with when to come again.
    pub fn retry_after(self, wait: Duration) -> Self {
        Self { retry_after: Some(wait), ..self }
    }

    /// The request is wrong in itself.
    pub fn invalid(reason: &'static str, message: impl Into<String>) -> Self {
        Self::new(ErrorCode::InvalidArgument, reason, message)
    }
}

impl From<NameError> for ServiceError {
    fn from(error: NameError) -> Self {
        Self::invalid("bad_name", error.to_string())
    }
}

impl From<PoseError> for ServiceError {
    fn from(error: PoseError) -> Self {
        Self::invalid("bad_pose", error.to_string())
    }
}

impl From<SettingError> for ServiceError {
    fn from(error: SettingError) -> Self {
        Self::invalid("bad_settings", error.to_string())
    }
}

impl From<FilterSettingsError> for ServiceError {
    fn from(error: FilterSettingsError) -> Self {
        Self::invalid("bad_settings", error.to_string())
    }
}

impl From<MapSettingsError> for ServiceError {
    fn from(error: MapSettingsError) -> Self {
        Self::invalid("bad_settings", error.to_string())
    }
}

impl From<RegionError> for ServiceError {
    fn from(error: RegionError) -> Self {
        Self::invalid("bad_region", error.to_string())
    }
}
