//! The time of day.

use std::time::SystemTime;

/// Nanoseconds since the Unix epoch, as the system's clock has it now.
pub fn unix_time_ns() -> i64 {
    let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX)
}
