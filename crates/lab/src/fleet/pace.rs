//! Pace: when the next operation is due.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use tokio::time::sleep_until;

/// Shared counter of operations, which are due one after the other or at a rate.
#[derive(Debug)]
pub(crate) struct Pace {
    start: Instant,
    time: Duration,
    /// Operations a second; none: each is due when the one before is done.
    rate: Option<f64>,
    /// True where operations that are late by a whole period are left out.
    skips: bool,
    first: u64,
    next: AtomicU64,
}

/// An operation that is due.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Due {
    /// Number of the operation.
    pub(crate) number: u64,
    /// Time at which it was due. At a rate, a late start counts as part of the operation's latency.
    pub(crate) since: Instant,
}

impl Pace {
    /// A pace that begins now with the number `first`, and ends after `time`.
    pub(crate) fn new(rate: Option<f64>, time: Duration, first: u64) -> Self {
        Self { start: Instant::now(), time, rate, skips: false, first, next: AtomicU64::new(first) }
    }

    /// The same pace, which leaves out what is late by a whole period: the next operation is the newest that is due.
    pub(crate) fn skipping(self) -> Self {
        Self { skips: true, ..self }
    }

    /// Returns the next number.
    pub(crate) fn next(&self) -> u64 {
        self.next.load(Ordering::Relaxed)
    }

    /// Waits until an operation is due; none when the time is over.
    pub(crate) async fn due(&self) -> Option<Due> {
        if let Some(rate) = self.rate.filter(|_| self.skips) {
            let newest = self.first + (self.start.elapsed().as_secs_f64() * rate) as u64;
            self.next.fetch_max(newest, Ordering::Relaxed);
        }
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let since = match self.rate {
            Some(rate) => self.start + Duration::from_secs_f64((number - self.first) as f64 / rate),
            None => Instant::now(),
        };
        if since - self.start >= self.time {
            return None;
        }
        // A sleep of no time takes as long as the timer's tick.
        if since > Instant::now() {
            sleep_until(since.into()).await;
        }
        Some(Due { number, since })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn operations_are_due_at_their_rate_whoever_is_late() {
        let pace = Pace::new(Some(100.0), Duration::from_millis(50), 7);
        let first = pace.due().await.unwrap();
        tokio::time::sleep(Duration::from_millis(30)).await;
        let second = pace.due().await.unwrap();
        assert_eq!((first.number, second.number), (7, 8));
        assert_eq!(second.since - first.since, Duration::from_millis(10));
        assert!(second.since.elapsed() >= Duration::from_millis(19));
        for _ in 2..5 {
            assert!(pace.due().await.is_some());
        }
        assert!(pace.due().await.is_none());
    }

    #[tokio::test]
    async fn who_skips_is_never_late_by_a_whole_period() {
        let pace = Pace::new(Some(100.0), Duration::from_secs(60), 7).skipping();
        assert_eq!(pace.due().await.unwrap().number, 7);
        tokio::time::sleep(Duration::from_millis(55)).await;
        let before = Instant::now();
        let late = pace.due().await.unwrap();
        assert!(late.number >= 12, "{late:?}");
        assert!(before.saturating_duration_since(late.since) <= Duration::from_millis(10), "{late:?}");
    }
}
