//! A number of things at once.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use mrol_service::ServiceError;

/// As many as a limit allows. A clone counts the same.
#[derive(Debug, Clone)]
pub(super) struct Quota {
    limit: &'static str,
    most: usize,
    free: Arc<Semaphore>,
}

/// One slot of a quota, until it is dropped.
pub(super) type QuotaSlot = OwnedSemaphorePermit;

impl Quota {
    pub(super) fn new(limit: &'static str, most: usize) -> Self {
        Self { limit, most, free: Arc::new(Semaphore::new(most)) }
    }

    /// # Errors
    /// Names the limit when there is none left.
    pub(super) fn take(&self) -> Result<QuotaSlot, ServiceError> {
        Arc::clone(&self.free).try_acquire_owned().map_err(|_| self.refusal())
    }

    pub(super) fn is_full(&self) -> bool {
        self.free.available_permits() == 0
    }

    pub(super) fn taken(&self) -> usize {
        self.most - self.free.available_permits()
    }

    pub(super) fn refusal(&self) -> ServiceError {
        ServiceError::overloaded(format!("{} is {}: all are in use, try again", self.limit, self.most))
    }
}
