//! Counts of headers, checked against the bytes that are there.

use super::error::Problem;
use super::supported::POINTS_MAX;

/// Refuses `count` entries of at least `entry_bytes` each where only `have` bytes follow, or too many entries.
pub(super) fn check_count(what: &str, count: u64, entry_bytes: u64, have: usize) -> Result<(), Problem> {
    if count > POINTS_MAX {
        return Err(Problem::new(format!("the header declares {count} {what}, the limit is {POINTS_MAX}")));
    }
    let fits = count.checked_mul(entry_bytes).is_some_and(|need| need <= have as u64);
    if !fits || (entry_bytes == 0 && count > 0) {
        return Err(Problem::new(format!(
            "the header declares {count} {what} of at least {entry_bytes} bytes each, but {have} bytes follow: \
             the file is truncated or its header wrong"
        )));
    }
    Ok(())
}
