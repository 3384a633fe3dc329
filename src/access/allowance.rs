//! How often, and how often at once, the holder of a key may ask.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::Duration;

use governor::clock::{Clock, DefaultClock};
use governor::{DefaultDirectRateLimiter, Quota, RateLimiter};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::service::ServiceError;

/// Bounds of a key's own, each in place of the server's for one caller; none = the server's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct KeyLimits {
    /// Requests and messages of streams a second; in place of `limits.caller_requests_per_s_max`.
    pub requests_per_s_max: Option<NonZeroU32>,
    /// As many may come at once; in place of `limits.caller_burst_max`. Of use with a rate alone.
    pub burst_max: Option<NonZeroU32>,
    /// Requests and streams in work at a time; the server bounds those of all callers together alone.
    pub requests_at_once_max: Option<NonZeroU32>,
}

/// Requests that come at once where a key sets a rate and says nothing of that.
const BURST_DEFAULT: NonZeroU32 = NonZeroU32::new(100).expect("more than zero");

/// What a key's limits have left. Both secrets of a key draw on the same.
#[derive(Debug)]
pub struct Allowance {
    pub(super) limits: KeyLimits,
    rate: Option<DefaultDirectRateLimiter>,
    at_once: Option<Arc<Semaphore>>,
}

/// A request in work, until it is dropped.
pub type InWork = Option<OwnedSemaphorePermit>;

impl Allowance {
    pub(super) fn new(limits: KeyLimits) -> Self {
        let rate = limits.requests_per_s_max.map(|per_s| {
            RateLimiter::direct(
                Quota::per_second(per_s).allow_burst(limits.burst_max.unwrap_or(BURST_DEFAULT)),
            )
        });
        let at_once = limits.requests_at_once_max.map(|most| Arc::new(Semaphore::new(most.get() as usize)));
        Self { limits, rate, at_once }
    }

    /// Counts a request by the key's own rate; none where it has none, and the server's counts.
    ///
    /// # Errors
    /// When `who` asks too often; the error says when to come again.
    pub fn check_rate(&self, who: &str) -> Option<Result<(), ServiceError>> {
        let (rate, per_s_max) = (self.rate.as_ref()?, self.limits.requests_per_s_max?);
        Some(rate.check().map_err(|not_yet| {
            let wait = not_yet.wait_time_from(DefaultClock::default().now());
            let message =
                format!("requests_per_s_max is {per_s_max}: {who} asks more often, try again in {wait:.1?}");
            ServiceError::overloaded(message).retry_after(wait.max(Duration::from_millis(1)))
        }))
    }

    /// Takes a place for a request in work.
    ///
    /// # Errors
    /// When as many of `who` are in work as may be.
    pub fn begin(&self, who: &str) -> Result<InWork, ServiceError> {
        let Some(at_once) = &self.at_once else { return Ok(None) };
        Arc::clone(at_once).try_acquire_owned().map(Some).map_err(|_| {
            let most = self.limits.requests_at_once_max.map_or(0, NonZeroU32::get);
            ServiceError::overloaded(format!("requests_at_once_max is {most}: {who} has as many in work"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_refused_beyond_its_own_numbers_and_not_before() {
        let two = NonZeroU32::new(2);
        let limits =
            KeyLimits { requests_per_s_max: NonZeroU32::new(1), burst_max: two, requests_at_once_max: two };
        let allowance = Allowance::new(limits);
        let rates: Vec<bool> = (0..3).map(|_| allowance.check_rate("key a").unwrap().is_ok()).collect();
        assert_eq!(rates, [true, true, false]);

        let held = [allowance.begin("key a").unwrap(), allowance.begin("key a").unwrap()];
        let refused = allowance.begin("key a").unwrap_err().message;
        assert_eq!(refused, "requests_at_once_max is 2: key a has as many in work");
        drop(held);
        assert!(allowance.begin("key a").is_ok());

        let none = Allowance::new(KeyLimits::default());
        assert!(none.check_rate("key a").is_none() && none.begin("key a").unwrap().is_none());
    }
}
