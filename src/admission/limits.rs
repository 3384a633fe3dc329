//! How much is let in at once.

use std::time::Duration;

/// Bounds on all requests together. Each is named in the refusal of what is beyond it.
#[derive(Debug, Clone, PartialEq)]
pub struct AdmissionLimits {
    /// Requests in work, and as many whose bodies are arriving. 512.
    pub requests_max: usize,
    /// Calls whose client streams messages. 256.
    pub streams_max: usize,
    /// Bytes of bodies that have arrived and of listings and files that are being sent. 1 GiB.
    pub body_bytes_max: usize,
    /// How long a body may be silent before its end. 30 s.
    pub body_silence_max: Duration,
    /// Bytes a second of a body that comes in time; what comes more slowly counts as silent for the time that its bytes
    /// do not account for. 0 = any byte will do. 1024.
    pub body_bytes_per_s_min: u32,
    /// Requests and messages of streams a second of one caller: of a key, or of an address where there is none;
    /// 0 = any number. 0.
    pub caller_requests_per_s_max: u32,
    /// As many may come at once. 100.
    pub caller_burst_max: u32,
    /// Requests and streams in work at a time of one key that says nothing of that itself; 0 = any number. Less than half of
    /// `requests_max`, so that no key keeps the others out. 192.
    pub caller_requests_at_once_max: u32,
    /// Health checks that are arriving, and as many that are answered, over each protocol. Where all places are taken,
    /// the oldest gives way. 64.
    pub probes_max: usize,
    /// Bytes of the body of a health check, which comes as it is: nothing is inflated. 1 KiB.
    pub probe_body_bytes_max: usize,
    /// How long the body of a health check may take. 5 s.
    pub probe_time_max: Duration,
    /// Scrapes of the metrics that wait or are being read. 16.
    pub scrapes_max: usize,
    /// How long the text of a scrape answers those that follow. 1 s.
    pub scrape_kept: Duration,
    /// Calls of `grpc.health.v1.Health/Watch`, one a connection. 16.
    pub health_watches_max: usize,
    /// How long one of them lasts that came without a key. 600 s.
    pub health_watch_max: Duration,
}

impl Default for AdmissionLimits {
    fn default() -> Self {
        Self {
            requests_max: 512,
            streams_max: 256,
            body_bytes_max: 1 << 30,
            body_silence_max: Duration::from_secs(30),
            body_bytes_per_s_min: 1024,
            caller_requests_per_s_max: 0,
            caller_burst_max: 100,
            caller_requests_at_once_max: 192,
            probes_max: 64,
            probe_body_bytes_max: 1 << 10,
            probe_time_max: Duration::from_secs(5),
            scrapes_max: 16,
            scrape_kept: Duration::from_secs(1),
            health_watches_max: 16,
            health_watch_max: Duration::from_secs(600),
        }
    }
}
