//! When the scans of a log are sent that is played as fast as it was recorded.

use std::fmt;
use std::fmt::Display;
use std::time::Duration;

use tokio::time::Instant;

/// Stamps that lie farther apart than this, or go back, begin a new pace: a clock was set, or the robot was off.
const GAP_MAX: Duration = Duration::from_secs(60);

/// The pace of a log: a scan is due as long after the first one as its stamp says.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// When a scan was due, and its stamp in nanoseconds.
    begin: Option<(Instant, i64)>,
    last_ns: i64,
    lateness: Lateness,
}

/// How late scans were sent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Lateness {
    /// Of the last scan.
    last: Duration,
    /// Of the scan that was the latest.
    most: Duration,
}

impl Pace {
    /// Waits until the scan of this stamp is due, and not at all where it is late.
    pub(super) async fn wait(&mut self, stamp_ns: i64) {
        tokio::time::sleep_until(self.due(Instant::now(), stamp_ns)).await;
    }

    /// How late the scans so far were sent.
    pub(super) fn lateness(&self) -> Lateness {
        self.lateness
    }

    /// When the scan of this stamp is due, if it is `now`.
    fn due(&mut self, now: Instant, stamp_ns: i64) -> Instant {
        let step = stamp_ns.checked_sub(self.last_ns).and_then(|step| u64::try_from(step).ok());
        let goes_on = step.is_some_and(|step| Duration::from_nanos(step) <= GAP_MAX);
        self.last_ns = stamp_ns;
        let (begin, begin_ns) = match self.begin.filter(|_| goes_on) {
            Some(begin) => begin,
            None => *self.begin.insert((now, stamp_ns)),
        };
        let since = stamp_ns.checked_sub(begin_ns).and_then(|since| u64::try_from(since).ok());
        let due = begin + Duration::from_nanos(since.unwrap_or_default());
        let last = now.saturating_duration_since(due);
        self.lateness = Lateness { last, most: self.lateness.most.max(last) };
        due
    }
}

impl Display for Lateness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (last, most) = (self.last.as_secs_f64(), self.most.as_secs_f64());
        write!(f, "the last scan was sent {last:.1} s late, the latest one {most:.1} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: Duration = Duration::from_secs(1);

    #[test]
    fn a_scan_is_due_when_its_stamp_says_and_one_behind_a_late_one_too() {
        let (mut pace, begin) = (Pace::default(), Instant::now());
        assert_eq!(pace.due(begin, 5_000_000_000), begin);
        assert_eq!(pace.due(begin + S / 10, 6_000_000_000), begin + S);
        // The server took four seconds.
        assert_eq!(pace.due(begin + 5 * S, 7_000_000_000), begin + 2 * S);
        assert_eq!(pace.lateness(), Lateness { last: 3 * S, most: 3 * S });
        assert_eq!(pace.due(begin + 6 * S, 11_000_000_000), begin + 6 * S);
        assert_eq!(pace.lateness(), Lateness { last: Duration::ZERO, most: 3 * S });
        let text = "the last scan was sent 0.0 s late, the latest one 3.0 s";
        assert_eq!(pace.lateness().to_string(), text);
    }

    #[test]
    fn a_clock_that_was_set_or_a_long_gap_begins_anew() {
        let (mut pace, begin) = (Pace::default(), Instant::now());
        pace.due(begin, 100_000_000_000);
        for stamp_ns in [99_000_000_000, 200_000_000_000, i64::MAX, i64::MIN, 0] {
            assert_eq!(pace.due(begin + S, stamp_ns), begin + S, "{stamp_ns}");
        }
    }
}
