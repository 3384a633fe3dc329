//! Between what is stored and the domain: every message of `proto/mrol/store/v1`, there and back.
//!
//! Numbers come back bit for bit. What cannot be read is said as a sentence; who reads adds file and offset.

mod change;
pub(super) mod moments;
mod scan;
pub(super) mod voxels;

pub(super) use scan::with_forgotten;

/// What is wrong with a message; of no meaning once its reading was stopped.
pub(super) type Unreadable = String;

/// The value of a field that must be there.
fn required<T>(value: Option<T>, field: &str) -> Result<T, Unreadable> {
    value.ok_or_else(|| format!("{field} is missing"))
}

/// A count. Machines of less than 64 bits hold no map that would notice.
fn count(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}
