//! Errors of a fleet.

use std::fmt::Display;

use mrol::server::ServerError;
use mrol_client::ClientError;

/// Errors of a fleet.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FleetError {
    /// The server refused a request, or cannot be reached.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The daemon cannot serve.
    #[error(transparent)]
    Server(#[from] ServerError),
    /// The options are not valid.
    #[error("{0}")]
    Usage(String),
    /// Anything else.
    #[error("{0}")]
    Failed(String),
}

impl FleetError {
    pub(super) fn usage(message: impl Display) -> Self {
        Self::Usage(message.to_string())
    }

    pub(super) fn failed(message: impl Display) -> Self {
        Self::Failed(message.to_string())
    }
}
