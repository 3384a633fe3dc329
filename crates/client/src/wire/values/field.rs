//! Errors that say which field of a request they speak of.

use mrol_service::{Reason, ServiceError};

/// Puts a field's name before what is wrong with it.
pub trait InField<T> {
    /// The error, if any, as one of `field`.
    fn in_field(self, field: &str) -> Result<T, ServiceError>;
}

impl<T, E: Into<ServiceError>> InField<T> for Result<T, E> {
    fn in_field(self, field: &str) -> Result<T, ServiceError> {
        self.map_err(|error| {
            let mut error = error.into();
            error.message = format!("{field}: {}", error.message);
            error
        })
    }
}

/// The value of a field that must be there.
pub fn required<T>(value: Option<T>, field: &str) -> Result<T, ServiceError> {
    value.ok_or_else(|| ServiceError::new(Reason::MissingField, format!("{field} is missing")))
}
