//! Answered requests, for metrics and the audit.

use std::time::Duration;

use metrics::SharedString;

use super::audit::Audit;
use super::metrics::Metrics;

/// How a request ended.
#[derive(Debug, Clone)]
pub struct RequestOutcome {
    /// The protocol's status, as a label of metrics.
    pub code: SharedString,
    /// True where it was answered, false where it was refused or failed.
    pub is_ok: bool,
    /// Why its caller was not let in, where that is so.
    pub denial: Option<SharedString>,
}

/// Records requests when they are answered. A clone is another handle on the same metrics and audit.
#[derive(Debug, Clone)]
pub struct RequestRecorder {
    metrics: Metrics,
    audit: Audit,
}

impl RequestRecorder {
    /// Counts requests in `metrics`, and writes those that were not let in to `audit`.
    pub fn new(metrics: Metrics, audit: Audit) -> Self {
        Self { metrics, audit }
    }

    /// Where requests are counted.
    pub fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// Records a request, or a message of a stream; to be called within the request's span.
    pub fn answered(
        &self,
        protocol: &'static str,
        operation: &'static str,
        outcome: RequestOutcome,
        elapsed: Duration,
    ) {
        let RequestOutcome { code, denial, .. } = outcome;
        self.metrics.request(protocol, operation, code, elapsed);
        if let Some(reason) = denial {
            self.audit.denied(&reason);
            self.metrics.denied(protocol, reason);
        }
    }
}
