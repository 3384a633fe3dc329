//! Logs: the messages of a file, one by one, in the order in which they were recorded.

mod error;
mod mcap;
mod message;

pub use error::{Damage, DamageKind, LogError};
pub use mcap::{CHUNK_BYTES_MAX, McapReader};
pub use message::{LogMessage, Topic};
