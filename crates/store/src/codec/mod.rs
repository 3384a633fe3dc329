//! Conversion between stored messages and domain types, both ways, for every message of `proto/mrol/store/v1`.
//!
//! Numbers are restored bit for bit. What cannot be read is described in a sentence; the caller adds file and offset.

mod change;
mod keep_out;
pub(super) mod moments;
mod scan;
mod viewpoint;
pub(super) mod voxels;

pub(super) use scan::with_forgotten;
pub(super) use viewpoint::{ascending_from, gaps_of};

/// Description of what is wrong with a message; meaningless once its reading was stopped.
pub(super) type Unreadable = String;

/// Returns the value of a required field.
pub(super) fn required<T>(value: Option<T>, field: &str) -> Result<T, Unreadable> {
    value.ok_or_else(|| format!("{field} is missing"))
}

/// Converts a count to `usize`; larger counts saturate.
fn count(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}
