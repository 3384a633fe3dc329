//! How many of a number of things one caller may have at once, so that nobody has them all.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::sync::Arc;

use parking_lot::Mutex;

use mrol_service::{Asker, ServiceError};

/// As many for each caller as a limit allows: for each key, and each address of callers without a key. A clone counts
/// the same.
#[derive(Debug, Clone)]
pub(super) struct Shares {
    limit: &'static str,
    what: &'static str,
    /// Any number without.
    most: Option<NonZeroUsize>,
    taken: Arc<Mutex<HashMap<Asker, usize>>>,
}

/// One of a caller's share, until it is dropped.
#[derive(Debug)]
pub(super) struct Share {
    asker: Asker,
    taken: Arc<Mutex<HashMap<Asker, usize>>>,
}

impl Shares {
    /// At most `most` of `what` for each caller, 0 for any number.
    pub(super) fn new(limit: &'static str, what: &'static str, most: usize) -> Self {
        Self { limit, what, most: NonZeroUsize::new(most), taken: Arc::default() }
    }

    /// # Errors
    /// `ResourceExhausted`, naming the limit and the caller, where the caller has as many as it may.
    pub(super) fn take(&self, asker: &Asker) -> Result<Option<Share>, ServiceError> {
        let Some(most) = self.most else { return Ok(None) };
        let mut taken = self.taken.lock();
        let of_caller = taken.entry(asker.clone()).or_default();
        if *of_caller >= most.get() {
            let Self { limit, what, .. } = self;
            let message = format!("{limit} is {most}: {asker} has as many {what}, end one first");
            return Err(ServiceError::overloaded(message));
        }
        *of_caller += 1;
        Ok(Some(Share { asker: asker.clone(), taken: Arc::clone(&self.taken) }))
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut taken = self.taken.lock();
        if let Some(of_caller) = taken.get_mut(&self.asker) {
            *of_caller -= 1;
            if *of_caller == 0 {
                taken.remove(&self.asker);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caller_has_a_share_and_leaves_the_rest_to_others() {
        let shares = Shares::new("caller_watches_max", "watches", 2);
        let (one, other) = (Asker::at("10.0.0.1"), Asker::with_key("viewer"));
        let mut held: Vec<_> = (0..2).map(|_| shares.take(&one).unwrap()).collect();
        let refused = shares.take(&one).unwrap_err();
        assert!(
            refused.message.starts_with("caller_watches_max is 2: ") && refused.message.contains("10.0.0.1"),
            "{refused}"
        );
        let of_other = shares.take(&other).unwrap();
        held.pop();
        let again = shares.take(&one).unwrap();
        drop((held, of_other, again));
        assert!(shares.taken.lock().is_empty(), "callers who have nothing are forgotten");
    }

    #[test]
    fn without_a_limit_a_caller_has_any_number() {
        let shares = Shares::new("caller_watches_max", "watches", 0);
        assert!((0..1000).all(|_| shares.take(&Asker::default()).unwrap().is_none()));
    }
}
