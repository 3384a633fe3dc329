//! TLS handshakes that failed: counted, and told a few at a time.

use std::fmt::Display;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::protocol::Protocol;
use crate::access::Peer;

/// How often one is told, at most: whoever scans ports fails many.
const TELLING_INTERVAL: Duration = Duration::from_secs(10);

/// How many handshakes failed.
#[derive(Debug, Default)]
pub(super) struct FailedHandshakes {
    http: AtomicU64,
    grpc: AtomicU64,
    told: Mutex<Told>,
}

#[derive(Debug, Default)]
struct Told {
    last: Option<Instant>,
    /// Failures since then.
    untold: u64,
}

impl FailedHandshakes {
    /// Counts one, and tells it unless another was told just before.
    pub(super) fn add(&self, protocol: Protocol, peer: Peer, why: &dyn Display) {
        self.of(protocol).fetch_add(1, Ordering::Relaxed);
        let untold = self.told.lock().tell(Instant::now());
        if let Some(untold) = untold {
            let protocol = protocol.as_str();
            tracing::warn!(protocol, %peer, error = %why, untold, "a connection could not be secured");
        }
    }

    /// How many handshakes of a protocol have failed.
    pub(super) fn count(&self, protocol: Protocol) -> u64 {
        self.of(protocol).load(Ordering::Relaxed)
    }

    fn of(&self, protocol: Protocol) -> &AtomicU64 {
        match protocol {
            Protocol::Http | Protocol::Admin => &self.http,
            Protocol::Grpc => &self.grpc,
        }
    }
}

impl Told {
    /// How many were not told before this one, which is; none where this one is not told either.
    fn tell(&mut self, now: Instant) -> Option<u64> {
        if self.last.is_some_and(|last| now.duration_since(last) < TELLING_INTERVAL) {
            self.untold += 1;
            return None;
        }
        self.last = Some(now);
        Some(std::mem::take(&mut self.untold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_failures_one_is_told_with_the_number_of_the_others() {
        let (mut told, now) = (Told::default(), Instant::now());
        assert_eq!(told.tell(now), Some(0));
        assert_eq!([told.tell(now), told.tell(now + TELLING_INTERVAL / 2)], [None, None]);
        assert_eq!(told.tell(now + TELLING_INTERVAL), Some(2));
        assert_eq!(told.tell(now + 3 * TELLING_INTERVAL), Some(0));
    }
}
