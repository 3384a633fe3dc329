//! Every limit of the server, by name, with its default; and the checks of requests against them.

mod checks;
mod service_limits;

pub use service_limits::{Limits, Marks};
