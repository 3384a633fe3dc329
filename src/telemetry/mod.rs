//! What the daemon says of itself: log lines and Prometheus metrics.

mod exposition;
mod families;
mod log;
mod map_counters;
mod metered;
mod metrics;

pub use log::{LogFormat, TelemetryError, start_logging};
pub use metered::MeteredService;
pub use metrics::{Metrics, OpenConnection};
