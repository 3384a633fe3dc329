//! How often a caller may ask.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::Duration;

use axum::http::Extensions;
use governor::clock::{Clock, DefaultClock};
use governor::state::keyed::HashMapStateStore;
use governor::{Quota, RateLimiter};

use super::shares::{Share, Shares};
use crate::access::{Allowance, Authorized, InWork, asker_of};
use mrol_service::{Asker, Limits, ServiceError};

/// Whom a request counts for: the name of its key, or where there is none the place that it came from.
#[derive(Debug, Clone)]
pub struct RateLimitKey {
    asker: Asker,
    /// The bounds of its key.
    own: Option<Arc<Allowance>>,
}

impl RateLimitKey {
    /// As a request's extensions say.
    pub fn of(request: &Extensions) -> Self {
        let caller = request.get::<Authorized>().map(|authorized| &authorized.caller);
        let asker = asker_of(caller.and_then(|caller| caller.name()), request.get());
        Self { asker, own: caller.and_then(|caller| caller.allowance()).cloned() }
    }

    /// Counts a request by the rate of the caller's key, or by `rates` where it has none.
    ///
    /// # Errors
    /// When the caller asks too often.
    pub(super) fn check_rate(&self, rates: Option<&Rates>) -> Result<(), ServiceError> {
        let own = self.own.as_ref().and_then(|own| own.check_rate(self.asker.as_str()));
        own.unwrap_or_else(|| rates.map_or(Ok(()), |rates| rates.check(self)))
    }

    /// Takes one of the caller's share.
    ///
    /// # Errors
    /// When the caller has all of it.
    pub(super) fn take(&self, shares: &Shares) -> Result<Option<Share>, ServiceError> {
        shares.take(&self.asker)
    }

    /// Takes a place among those of the caller's key, which are as many as it says, or `usual`.
    ///
    /// # Errors
    /// When all are taken.
    pub(super) fn begin(&self, usual: Option<NonZeroU32>) -> Result<Option<InWork>, ServiceError> {
        self.own.as_ref().map(|own| own.begin(self.asker.as_str(), usual)).transpose()
    }
}

/// Counts requests by caller.
pub(super) struct Rates {
    limiter: RateLimiter<Asker, HashMapStateStore<Asker>, DefaultClock>,
    per_s_max: NonZeroU32,
}

impl Rates {
    /// None where any number is fine.
    pub(super) fn new(limits: &Limits) -> Option<Self> {
        let per_s_max = NonZeroU32::new(limits.caller_requests_per_s_max)?;
        let burst_max = NonZeroU32::new(limits.caller_burst_max).unwrap_or(NonZeroU32::MIN);
        let quota = Quota::per_second(per_s_max).allow_burst(burst_max);
        Some(Self { limiter: RateLimiter::hashmap(quota), per_s_max })
    }

    /// # Errors
    /// When the caller asks too often; the error says when to come again.
    pub(super) fn check(&self, asking: &RateLimitKey) -> Result<(), ServiceError> {
        self.limiter.check_key(&asking.asker).map_err(|not_yet| {
            let wait = not_yet.wait_time_from(DefaultClock::default().now());
            let message = format!(
                "caller_requests_per_s_max is {}: {} asks more often, try again in {wait:.1?}",
                self.per_s_max, asking.asker
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
