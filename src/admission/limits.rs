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
        }
    }
}
