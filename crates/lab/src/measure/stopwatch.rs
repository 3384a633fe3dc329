//! Timing of repeated work.

use std::hint::black_box;
use std::time::{Duration, Instant};

/// Durations of several runs of the same work, nanoseconds an item.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Runs(Vec<f64>);

impl Runs {
    /// Runs `work` on `items` items once, records its duration, and returns its result.
    pub fn time<T>(&mut self, items: usize, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        // The compiler may neither start the work before the clock nor drop it for want of a use of its result.
        let result = black_box(work());
        self.push(items, start.elapsed());
        result
    }

    /// Records the duration of a run on `items` items that was timed elsewhere.
    pub fn push(&mut self, items: usize, elapsed: Duration) {
        self.0.push(elapsed.as_nanos() as f64 / items.max(1) as f64);
    }

    /// The median run, which occasional load of the same core does not move; 0 without a run.
    pub fn median(&self) -> f64 {
        median_of(self.0.clone())
    }

    /// The median of how many times as long each run took as that of `others` beside it, which load that comes and goes
    /// does not move; 0 without a run.
    pub fn median_ratio(&self, others: &Self) -> f64 {
        median_of(self.0.iter().zip(&others.0).map(|(run, other)| run / other).collect())
    }

    /// All runs, in order.
    pub fn ns_per_item(&self) -> &[f64] {
        &self.0
    }
}

fn median_of(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    match (values.len(), values.len() / 2) {
        (0, _) => 0.0,
        (n, middle) if n % 2 == 1 => values[middle],
        (_, middle) => (values[middle - 1] + values[middle]) / 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_run_whatever_the_order() {
        assert_eq!(Runs(vec![9.0, 1.0, 2.0]).median(), 2.0);
        assert_eq!(Runs(vec![4.0, 1.0, 2.0, 100.0]).median(), 3.0);
        assert_eq!(Runs::default().median(), 0.0);
    }

    #[test]
    fn runs_are_compared_with_those_beside_them() {
        let (calm, load) = ([1.0, 1.0, 4.0, 4.0, 4.0], [2.0, 2.0, 8.0, 8.0, 1.0]);
        assert_eq!(Runs(load.into()).median_ratio(&Runs(calm.into())), 2.0);
        assert_eq!(Runs::default().median_ratio(&Runs::default()), 0.0);
    }

    #[test]
    fn a_run_is_kept_for_each_time() {
        let mut runs = Runs::default();
        assert_eq!(runs.time(10, || 7), 7);
        runs.time(10, || ());
        assert_eq!(runs.ns_per_item().len(), 2);
    }
}
