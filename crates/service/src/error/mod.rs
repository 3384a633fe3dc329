//! The error of every operation: a code, a reason and a message.

mod code;
mod map_holder;
mod reason;
mod service_error;

pub use code::ErrorCode;
pub use map_holder::MapHolder;
pub use reason::{Reason, ReportedBy};
pub use service_error::ServiceError;
