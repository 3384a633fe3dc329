//! The file of keys: TOML, a table a key.
//!
//! ```toml
//! [[key]]
//! name = "r1"
//! sha256 = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"   # of the secret
//! scope = "insert"               # read, insert, write or admin
//! maps = ["hall", "office"]      # without it: every map
//! robots = ["r1"]                # whose scans it sends and undoes; without it: every robot's
//! expires = 2027-01-31           # a date or a time (2027-01-31T12:00:00Z); without it: never
//! requests_per_s_max = 20        # in place of limits.caller_requests_per_s_max
//! burst_max = 40                 # in place of limits.caller_burst_max
//! requests_at_once_max = 4       # in place of limits.caller_requests_at_once_max
//! former_sha256 = "60303ae2..."  # the secret before the last rotation,
//! former_expires = 2026-12-01    # which counts until then
//! ```
//!
//! It holds hashes, so that whoever reads it can open nothing with it. What is wrong with it is said without repeating
//! any value: somebody may have put a secret where none belongs.

mod change;
mod entry;
mod reading;

pub use change::{add_to_file, revoke_in_file, rotate_in_file};
pub use entry::KeyEntry;
pub(crate) use reading::read;
pub use reading::{KeyFileError, list_file, to_toml};
