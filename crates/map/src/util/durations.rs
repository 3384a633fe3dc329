//! How long things took, counted in classes of seconds.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Upper bounds of the classes, seconds, ascending; the last class has none. From a sync of a fast disk to a disk that
/// hangs.
const BOUNDS_S: [f64; 15] =
    [0.0001, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 2.5, 10.0, 30.0, 60.0];

const CLASSES: usize = BOUNDS_S.len() + 1;

/// How often something took how long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Durations {
    counts: [u64; CLASSES],
    sum: Duration,
}

impl Durations {
    /// Counts one more.
    pub fn record(&mut self, took: Duration) {
        self.counts[class_of(took)] += 1;
        self.sum += took;
    }

    /// How many durations were counted.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// How long they took together.
    pub fn sum(&self) -> Duration {
        self.sum
    }

    /// Each bound, in seconds, with how many took no longer.
    pub fn at_most(&self) -> impl Iterator<Item = (f64, u64)> {
        let mut all = 0;
        BOUNDS_S.into_iter().zip(self.counts).map(move |(bound_s, count)| {
            all += count;
            (bound_s, all)
        })
    }
}

/// [`Durations`] that several threads count and read at once.
#[derive(Debug, Default)]
pub struct SharedDurations {
    counts: [AtomicU64; CLASSES],
    sum_ns: AtomicU64,
}

impl SharedDurations {
    /// Counts one more.
    pub fn record(&self, took: Duration) {
        self.counts[class_of(took)].fetch_add(1, Ordering::Relaxed);
        // 584 years of waiting fit.
        self.sum_ns.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// What was counted up to now.
    pub fn read(&self) -> Durations {
        let counts = std::array::from_fn(|class| self.counts[class].load(Ordering::Relaxed));
        Durations { counts, sum: Duration::from_nanos(self.sum_ns.load(Ordering::Relaxed)) }
    }
}

fn class_of(took: Duration) -> usize {
    let seconds = took.as_secs_f64();
    BOUNDS_S.partition_point(|&bound_s| bound_s < seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_counts_in_the_first_class_that_holds_it_and_in_all_after() {
        let (mut one, shared) = (Durations::default(), SharedDurations::default());
        for ms in [0, 1, 2, 700, 60_000, 61_000] {
            one.record(Duration::from_millis(ms));
            shared.record(Duration::from_millis(ms));
        }
        assert_eq!(one, shared.read());
        let at_most: Vec<_> =
            one.at_most().filter(|(bound_s, _)| [0.0001, 0.001, 0.25, 1.0, 60.0].contains(bound_s)).collect();
        assert_eq!(at_most, [(0.0001, 1), (0.001, 2), (0.25, 3), (1.0, 4), (60.0, 5)]);
        assert_eq!((one.count(), one.sum()), (6, Duration::from_millis(121_703)));
    }
}
