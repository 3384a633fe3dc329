//! Limits that have to fit together. The limits themselves are [`Limits`], each with its range.

use super::error::ConfigError;
use mrol_service::Limits;

/// Refuses limits that contradict each other.
pub(super) fn check(limits: &Limits) -> Result<(), ConfigError> {
    let range = |key, range: &str, value: String| Err(ConfigError::Range { key, range: range.into(), value });
    if limits.body_bytes_max < limits.message_bytes_max {
        let least = "at least limits.message_bytes_max";
        return range("limits.body_bytes_max", least, limits.body_bytes_max.to_string());
    }
    // Each request may be on a connection of its own, in work or arriving, and each stream.
    if limits.connections_max <= 2 * limits.requests_max + limits.streams_max + limits.watches_max {
        let least = "more than twice limits.requests_max, limits.streams_max and limits.watches_max";
        return range("limits.connections_max", least, limits.connections_max.to_string());
    }
    check_marks(limits)
}

/// Refuses watermarks that are not in order.
fn check_marks(limits: &Limits) -> Result<(), ConfigError> {
    let range = |key, range: &str, value: u64| {
        Err(ConfigError::Range { key, range: range.into(), value: value.to_string() })
    };
    if limits.disk_free_resume_mib <= limits.disk_free_low_mib {
        let more = "more than limits.disk_free_low_mib";
        return range("limits.disk_free_resume_mib", more, limits.disk_free_resume_mib);
    }
    match (limits.memory_high_mib, limits.memory_resume_mib) {
        (_, 0) => Ok(()),
        (0, _) => {
            Err(ConfigError::Missing { needed: "limits.memory_high_mib", by: "limits.memory_resume_mib" })
        }
        (high, back) if back >= high => {
            range("limits.memory_resume_mib", "less than limits.memory_high_mib", back)
        }
        _ => Ok(()),
    }
}
