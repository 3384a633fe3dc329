//! What is known of a connection that a request came by.

use std::sync::{Arc, OnceLock};

use parking_lot::Mutex;
use tokio::time::Instant;

use super::quota::{Quota, QuotaSlot};
use mrol_service::ServiceError;

/// What the requests of one connection share; to be found among their extensions. A clone is another handle on it.
#[derive(Debug, Clone)]
pub struct OfConnection(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    /// The name of the first key that was shown.
    key: OnceLock<String>,
    /// True of a connection that was accepted when all slots were in use: it is for health checks alone.
    is_reserved: bool,
    admitted: Mutex<Admitted>,
    watches: Quota,
}

/// How many requests of a connection were let in and are not answered yet.
#[derive(Debug)]
struct Admitted {
    requests: usize,
    /// When the last of them was answered, or the connection came.
    last: Instant,
}

/// A request that was let in, until its answer is sent.
#[derive(Debug)]
pub(crate) struct LetIn(OfConnection);

impl OfConnection {
    /// The state of a new connection; `is_reserved` where it may ask for nothing but health.
    pub fn new(is_reserved: bool) -> Self {
        let watches = Quota::new("health watches of one connection", 1);
        let admitted = Mutex::new(Admitted { requests: 0, last: Instant::now() });
        Self(Arc::new(Shared { key: OnceLock::new(), is_reserved, admitted, watches }))
    }

    /// The name of the key that a request came with, the first that counts.
    pub fn key(&self) -> Option<&str> {
        self.0.key.get().map(String::as_str)
    }

    /// A request came with the key of that name, which counts.
    pub(crate) fn show_key(&self, name: &str) {
        self.0.key.get_or_init(|| name.to_owned());
    }

    /// Since when the connection has had no request that was let in; none while it has one. Requests that are refused,
    /// whatever becomes of their answers, are no use of a connection: limits bound how many are let in, and nothing
    /// bounds how many are refused.
    pub fn idle_since(&self) -> Option<Instant> {
        let admitted = self.0.admitted.lock();
        (admitted.requests == 0).then_some(admitted.last)
    }

    /// A request is let in.
    pub(crate) fn let_in(&self) -> LetIn {
        self.0.admitted.lock().requests += 1;
        LetIn(self.clone())
    }

    /// # Errors
    /// Where nothing but health may be asked for.
    pub(super) fn check(&self, asks_for_health: bool) -> Result<(), ServiceError> {
        if !self.0.is_reserved || asks_for_health {
            return Ok(());
        }
        let message = "connections_max are in use, and this connection is one of connections_reserved: it answers health \
                       checks alone, try again";
        Err(ServiceError::overloaded(message))
    }

    /// The connection's one health watch.
    ///
    /// # Errors
    /// Where it has one.
    pub(super) fn watch(&self) -> Result<QuotaSlot, ServiceError> {
        self.0.watches.take()
    }
}

impl Drop for LetIn {
    fn drop(&mut self) {
        let mut admitted = self.0.0.admitted.lock();
        admitted.requests -= 1;
        admitted.last = Instant::now();
    }
}
