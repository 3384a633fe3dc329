//! Logs: the messages of files, one by one, in the order in which they were recorded.
//!
//! ```text
//! bag        a log as users have it: a file, or the files of a folder one after another
//!   mcap         one file of MCAP            sqlite   one file of a database
//! messages   what all of them give: message after message, and where they end too early
//! ```

mod bag;
mod error;
mod mcap;
mod message;
mod messages;
#[cfg(feature = "sqlite")]
mod sqlite;

pub use bag::{Bag, ENDINGS};
pub use error::{Damage, DamageKind, LogError, Place};
pub use mcap::{CHUNK_BYTES_MAX, McapReader};
pub use message::{LogMessage, Topic};
pub use messages::Messages;
#[cfg(feature = "sqlite")]
pub use sqlite::{DatabaseReader, MESSAGE_BYTES_MAX};
