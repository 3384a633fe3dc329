//! Refusal of a message whose list is too long.

use tonic::Status;

use mrol_service::{Reason, ServiceError};

/// A list has more elements than it may.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct TooMany {
    /// From the message on, with dots.
    pub(super) field: String,
    pub(super) most: usize,
}

impl From<TooMany> for Status {
    fn from(TooMany { field, most }: TooMany) -> Self {
        let message = format!("{field} has more than {most} entries in one message");
        crate::wire::failure::status_of(ServiceError::new(Reason::BatchTooLarge, message))
    }
}
