//! Counters and latencies, kept by one server and rendered for Prometheus.

mod recorder;
#[cfg(test)]
mod tests;

pub use recorder::{InUse, Metrics, OpenConnection, ServiceReading};
