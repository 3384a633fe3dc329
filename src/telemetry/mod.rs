//! What the daemon says of itself: log lines and Prometheus metrics.

mod audit;
mod exposition;
mod families;
mod line_limit;
mod log;
mod map_counters;
mod metrics;
mod node;
mod refused_robots;
mod requests;

pub use self::audit::{AUDIT, Audit};
pub use self::log::{LogFormat, Logging, REQUEST, TelemetryError, start_logging};
pub use self::metrics::{InUse, Metrics, OpenConnection, ServiceReading};
pub use self::node::NodeReading;
pub use self::requests::{RequestOutcome, RequestRecorder};
