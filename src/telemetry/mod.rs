//! What the daemon says of itself: log lines and Prometheus metrics.

mod audit;
mod exposition;
mod families;
mod log;
mod map_counters;
mod metrics;
mod requests;

pub use audit::{AUDIT, Audit};
pub use log::{LogFormat, Logging, REQUEST, TelemetryError, start_logging};
pub use metrics::{InUse, Metrics, OpenConnection};
pub use requests::{RequestOutcome, RequestRecorder};
