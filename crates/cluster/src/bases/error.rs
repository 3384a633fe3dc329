//! What may go wrong with bases.

use crate::bucket::BucketError;

/// Why a base was not put, found or fetched.
#[derive(Debug, thiserror::Error)]
pub enum BaseError {
    /// Another node changed the pointer meanwhile.
    #[error("the map's base was changed by another")]
    Changed,
    /// What NATS holds is not what was put there.
    #[error("{0}")]
    Damaged(String),
    /// NATS refused, or did not answer.
    #[error("{0}")]
    Unavailable(String),
}

impl From<BucketError> for BaseError {
    fn from(error: BucketError) -> Self {
        match error {
            BucketError::Changed => Self::Changed,
            BucketError::Unavailable { .. } => Self::Unavailable(error.to_string()),
        }
    }
}
