//! What is wrong with a message that cannot be read.

/// Description of what is wrong with a message; meaningless once its reading was stopped.
pub(crate) type Unreadable = String;

/// Returns the value of a required field.
pub(crate) fn required<T>(value: Option<T>, field: &str) -> Result<T, Unreadable> {
    value.ok_or_else(|| format!("{field} is missing"))
}

/// Converts a count to `usize`; larger counts saturate.
pub(super) fn count(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}
