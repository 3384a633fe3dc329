//! How often, and how often at once, the holder of a key may ask.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use governor::clock::{Clock, DefaultClock};
use governor::{DefaultDirectRateLimiter, Quota, RateLimiter};

use mrol_service::ServiceError;

/// Bounds of a key's own, each in place of the server's for one caller; none = the server's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct KeyLimits {
    /// Requests and messages of streams a second; in place of `limits.caller_requests_per_s_max`.
    pub requests_per_s_max: Option<NonZeroU32>,
    /// As many may come at once; in place of `limits.caller_burst_max`. Of use with a rate alone.
    pub burst_max: Option<NonZeroU32>,
    /// Requests and streams in work at a time; in place of `limits.caller_requests_at_once_max`.
    pub requests_at_once_max: Option<NonZeroU32>,
}

/// Requests that come at once where a key sets a rate and says nothing of that.
const BURST_DEFAULT: NonZeroU32 = NonZeroU32::new(100).expect("more than zero");

/// What a key's limits have left. Both secrets of a key draw on the same.
#[derive(Debug)]
pub struct Allowance {
    pub(super) limits: KeyLimits,
    rate: Option<DefaultDirectRateLimiter>,
    at_once: Arc<AtomicUsize>,
}

/// A request in work, until it is dropped.
#[derive(Debug)]
pub struct InWork(Arc<AtomicUsize>);

impl Drop for InWork {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Allowance {
    pub(super) fn new(limits: KeyLimits) -> Self {
        let rate = limits.requests_per_s_max.map(|per_s| {
            RateLimiter::direct(
                Quota::per_second(per_s).allow_burst(limits.burst_max.unwrap_or(BURST_DEFAULT)),
            )
        });
        Self { limits, rate, at_once: Arc::default() }
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

    /// Takes a place for a request in work, of as many as the key says, or else of `usual`; any number where that is
    /// none.
    ///
    /// # Errors
    /// When as many of `who` are in work as may be.
    pub fn begin(&self, who: &str, usual: Option<NonZeroU32>) -> Result<InWork, ServiceError> {
        let (name, most) = match self.limits.requests_at_once_max {
            Some(own) => ("requests_at_once_max", Some(own)),
            None => ("caller_requests_at_once_max", usual),
        };
        let more = |now: usize| most.is_none_or(|most| now < most.get() as usize).then_some(now + 1);
        self.at_once.fetch_update(Ordering::Relaxed, Ordering::Relaxed, more).map_err(|now| {
            ServiceError::overloaded(format!("{name} is {now}: {who} has as many in work, try again"))
        })?;
        Ok(InWork(Arc::clone(&self.at_once)))
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

        let begin = |allowance: &Allowance| allowance.begin("key a", NonZeroU32::new(3));
        let held = [begin(&allowance).unwrap(), begin(&allowance).unwrap()];
        let refused = begin(&allowance).unwrap_err().message;
        assert_eq!(refused, "requests_at_once_max is 2: key a has as many in work, try again");
        drop(held);
        assert!(begin(&allowance).is_ok());
    }

    #[test]
    fn without_numbers_of_its_own_a_key_has_the_usual_ones() {
        let allowance = Allowance::new(KeyLimits::default());
        assert!(allowance.check_rate("key a").is_none());
        let _held = [(); 3].map(|()| allowance.begin("key a", NonZeroU32::new(3)).unwrap());
        let refused = allowance.begin("key a", NonZeroU32::new(3)).unwrap_err().message;
        assert_eq!(refused, "caller_requests_at_once_max is 3: key a has as many in work, try again");
        assert!(allowance.begin("key a", None).is_ok());
    }
}
