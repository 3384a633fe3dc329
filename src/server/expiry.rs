//! What expires, and how often its administrator is told.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

/// How often the same is told.
const TELLING_INTERVAL: Duration = Duration::from_secs(24 * 3600);

/// When what was last told.
#[derive(Debug, Default)]
pub(super) struct Reminders(Mutex<BTreeMap<String, Instant>>);

impl Reminders {
    /// True where `what`, with its expiry, was not told within the last day: it is now.
    pub(super) fn is_due(&self, what: String, now: Instant) -> bool {
        let mut told = self.0.lock();
        told.retain(|_, last| now.duration_since(*last) < TELLING_INTERVAL);
        let is_due = !told.contains_key(&what);
        if is_due {
            told.insert(what, now);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_told_once_a_day() {
        let (reminders, now) = (Reminders::default(), Instant::now());
        let due = |what: &str, now| reminders.is_due(what.into(), now);
        assert!(due("a", now) && due("b", now));
        assert!(
            !due("a", now + TELLING_INTERVAL / 2)
                && !due("a", now + TELLING_INTERVAL - Duration::from_secs(1))
        );
        assert!(due("a", now + TELLING_INTERVAL));
    }
}
