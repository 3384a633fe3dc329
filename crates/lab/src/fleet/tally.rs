//! Tallies of operations: latencies and errors.

use std::collections::BTreeMap;
use std::time::Duration;

use hdrhistogram::Histogram;

use super::error::FleetError;

/// Longest latency that is told apart: longer ones count as ten minutes, in nanoseconds.
const LATENCY_NS_MAX: u64 = 600_000_000_000;
/// Significant digits of a latency.
const LATENCY_DIGITS: u8 = 3;

/// Latencies and errors of operations.
#[derive(Debug, Clone)]
pub(crate) struct Tally {
    /// Latencies, nanoseconds from the time at which an operation was due.
    latencies: Histogram<u64>,
    /// Number of errors, by message.
    pub(crate) errors: BTreeMap<String, u64>,
}

impl Tally {
    pub(crate) fn new() -> Result<Self, FleetError> {
        let latencies = Histogram::new_with_bounds(1, LATENCY_NS_MAX, LATENCY_DIGITS);
        Ok(Self { latencies: latencies.map_err(FleetError::failed)?, errors: BTreeMap::new() })
    }

    pub(crate) fn count(&mut self, took: Duration, failed: Option<String>) {
        self.latencies.saturating_record(took.as_nanos() as u64);
        if let Some(error) = failed {
            *self.errors.entry(error).or_default() += 1;
        }
    }

    /// Adds the counts of `other`.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), FleetError> {
        self.latencies.add(&other.latencies).map_err(FleetError::failed)?;
        for (error, count) in &other.errors {
            *self.errors.entry(error.clone()).or_default() += count;
        }
        Ok(())
    }

    pub(crate) fn operations(&self) -> u64 {
        self.latencies.len()
    }

    pub(crate) fn error_count(&self) -> u64 {
        self.errors.values().sum()
    }

    /// The quantile `share` of the latencies, milliseconds.
    pub(crate) fn quantile_ms(&self, share: f64) -> f64 {
        self.latencies.value_at_quantile(share) as f64 / 1e6
    }
}
