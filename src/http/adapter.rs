//! What every handler has at hand.

use super::scrapes::Scrapes;
use crate::admission::Admission;
use crate::telemetry::Metrics;
use mrol_service::ServiceError;

/// What every handler has at hand, besides the service that its caller may use.
#[derive(Debug, Clone)]
pub(super) struct Adapter {
    pub(super) admission: Admission,
    pub(super) metrics: Metrics,
    pub(super) message_bytes_max: usize,
    pub(super) scrapes: Scrapes,
    /// The description of the interface, as JSON.
    pub(super) description: fn() -> Result<&'static str, ServiceError>,
}
