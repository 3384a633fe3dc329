//! How often a caller may ask.

use std::net::IpAddr;
use std::num::NonZeroU32;
use std::time::Duration;

use axum::http::Extensions;
use governor::clock::{Clock, DefaultClock};
use governor::state::keyed::HashMapStateStore;
use governor::{Quota, RateLimiter};

use super::limits::AdmissionLimits;
use crate::access::Authorized;
use crate::service::ServiceError;

/// Where a request came from; whom it counts for where there is no key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Peer {
    /// An address.
    Address(IpAddr),
    /// A socket of this machine.
    Local,
}

impl std::fmt::Display for Peer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Address(address) => write!(f, "{address}"),
            Self::Local => f.write_str("local"),
        }
    }
}

/// Whom a request counts for: the name of its key, or where there is none the place that it came from.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Asking(String);

impl Asking {
    /// As a request's extensions say.
    pub fn of(request: &Extensions) -> Self {
        let key = request.get::<Authorized>().and_then(|authorized| authorized.caller.name());
        Self(match (key, request.get::<Peer>()) {
            (Some(key), _) => format!("key {key}"),
            (None, Some(peer)) => peer.to_string(),
            (None, None) => "somebody".into(),
        })
    }
}

/// Counts requests by caller.
pub(super) struct Rates {
    limiter: RateLimiter<Asking, HashMapStateStore<Asking>, DefaultClock>,
    per_s_max: NonZeroU32,
}

impl Rates {
    /// None where any number is fine.
    pub(super) fn new(limits: &AdmissionLimits) -> Option<Self> {
        let per_s_max = NonZeroU32::new(limits.caller_requests_per_s_max)?;
        let burst_max = NonZeroU32::new(limits.caller_burst_max).unwrap_or(NonZeroU32::MIN);
        let quota = Quota::per_second(per_s_max).allow_burst(burst_max);
        Some(Self { limiter: RateLimiter::hashmap(quota), per_s_max })
    }

    /// # Errors
    /// When the caller asks too often; the error says when to come again.
    pub(super) fn check(&self, asking: &Asking) -> Result<(), ServiceError> {
        self.limiter.check_key(asking).map_err(|not_yet| {
            let wait = not_yet.wait_time_from(DefaultClock::default().now());
            let message = format!(
                "caller_requests_per_s_max is {}: {} asks more often, try again in {wait:.1?}",
                self.per_s_max, asking.0
            );
            ServiceError::overloaded(message).retry_after(wait.max(Duration::from_millis(1)))
        })
    }

    /// Drops callers who could begin anew without a difference.
    pub(super) fn forget_old(&self) {
        self.limiter.retain_recent();
        self.limiter.shrink_to_fit();
    }
}

/// The limiter has no form to print.
impl std::fmt::Debug for Rates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Rates({} a second)", self.per_s_max)
    }
}
