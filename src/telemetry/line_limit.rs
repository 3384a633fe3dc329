//! A limit on lines of the log that anybody can cause, so that nobody fills its disk.

use std::num::NonZeroU32;
use std::sync::atomic::{AtomicU64, Ordering};

use governor::{DefaultDirectRateLimiter, Quota, RateLimiter};

/// Lines of a kind that are written, a second.
const LINES_PER_S_MAX: NonZeroU32 = NonZeroU32::new(10).expect("not zero");

/// How many lines of a kind are written: the others are counted in the next one.
#[derive(Debug)]
pub(super) struct LineLimit {
    rate: DefaultDirectRateLimiter,
    /// Lines that were not written since the last that was.
    unwritten: AtomicU64,
}

impl Default for LineLimit {
    fn default() -> Self {
        let rate = RateLimiter::direct(Quota::per_second(LINES_PER_S_MAX));
        Self { rate, unwritten: AtomicU64::new(0) }
    }
}

impl LineLimit {
    /// How many lines were not written since the last that was; none where this one is not written either.
    pub(super) fn to_write(&self) -> Option<u64> {
        if self.rate.check().is_err() {
            self.unwritten.fetch_add(1, Ordering::Relaxed);
            return None;
        }
        Some(self.unwritten.swap(0, Ordering::Relaxed))
    }
}
