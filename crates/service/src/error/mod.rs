//! The error of every operation: a code, a reason and a message.

mod code;
mod reason;
mod service_error;

pub use code::ErrorCode;
pub use reason::{Reason, ReportedBy};
pub use service_error::ServiceError;
