//! How a server goes down: what is in hand is finished within a bound, and nothing new begins.

use std::sync::Arc;

use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tokio_util::task::task_tracker::TaskTrackerToken;

use mrol_service::{Reason, ServiceError};

/// The state of a server's life, shared by its listeners. A clone is another handle on the same state.
///
/// ```text
/// serving --leave()--> leaving: it says that it is not ready, and serves on
///         --drain()--> draining: new requests are refused, those in flight go on
///         --cut()----> cut: those in flight are refused too
/// ```
#[derive(Debug, Clone, Default)]
pub struct Lifecycle {
    leaving: CancellationToken,
    draining: CancellationToken,
    cut: CancellationToken,
    /// True while a node of a cluster is behind the others.
    is_behind: Arc<watch::Sender<bool>>,
    in_flight: TaskTracker,
}

impl Lifecycle {
    /// True once the server was told to end: whoever sends requests is to send them elsewhere.
    pub fn is_leaving(&self) -> bool {
        self.leaving.is_cancelled()
    }

    /// Says from now on that the server is not ready, while it serves on: balancers and probes need a while to see it.
    pub fn leave(&self) {
        self.leaving.cancel();
    }

    /// True of a node of a cluster that has not joined it, or is too far behind the others: it serves, and whoever can
    /// is to ask another.
    pub fn is_behind(&self) -> bool {
        *self.is_behind.borrow()
    }

    /// Says whether it is.
    pub fn set_behind(&self, is_behind: bool) {
        self.is_behind.send_if_modified(|was| std::mem::replace(was, is_behind) != is_behind);
    }

    /// Whether it is, as it changes.
    pub fn behind(&self) -> watch::Receiver<bool> {
        self.is_behind.subscribe()
    }

    /// True once new requests are refused.
    pub fn is_draining(&self) -> bool {
        self.draining.is_cancelled()
    }

    /// Waits until new requests are refused.
    pub async fn draining(&self) {
        self.draining.cancelled().await;
    }

    /// Refuses new requests from now on.
    pub fn drain(&self) {
        self.leave();
        self.draining.cancel();
        self.in_flight.close();
    }

    /// Waits until no request is in flight.
    pub async fn idle(&self) {
        self.in_flight.wait().await;
    }

    /// Ends the requests that are still in flight.
    pub fn cut(&self) {
        self.cut.cancel();
    }

    /// What keeps the server from going down, within its bound, until it is dropped: for answers that are sent
    /// bit by bit after their request was handled.
    pub fn hold(&self) -> TaskTrackerToken {
        self.in_flight.token()
    }

    /// Runs a request, unless the server is going down.
    ///
    /// # Errors
    /// `Unavailable` when the server is draining, or is done with waiting for the request.
    pub async fn admit<T>(&self, request: impl Future<Output = T>) -> Result<T, ServiceError> {
        // Held before the question is asked: a waiter for the server to be idle then sees either this request
        // or its refusal.
        let _held = self.hold();
        if self.is_draining() {
            return Err(draining());
        }
        tokio::select! {
            answer = request => Ok(answer),
            () = self.cut.cancelled() => Err(draining()),
        }
    }
}

/// The refusal of a server that is going down.
pub fn draining() -> ServiceError {
    ServiceError::new(Reason::Draining, "server is draining")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::future::{pending, ready};

    #[tokio::test]
    async fn a_leaving_server_serves_on() {
        let lifecycle = Lifecycle::default();
        lifecycle.leave();
        assert!(lifecycle.is_leaving() && !lifecycle.is_draining());
        assert_eq!(lifecycle.admit(ready(1)).await, Ok(1));
        lifecycle.drain();
        assert!(lifecycle.is_draining());
    }

    #[tokio::test]
    async fn a_draining_server_refuses_new_requests_and_cuts_old_ones_when_told() {
        let lifecycle = Lifecycle::default();
        assert_eq!(lifecycle.admit(ready(1)).await, Ok(1));
        let stuck = tokio::spawn({
            let lifecycle = lifecycle.clone();
            async move { lifecycle.admit(pending::<()>()).await }
        });
        while lifecycle.in_flight.is_empty() {
            tokio::task::yield_now().await;
        }
        lifecycle.drain();
        assert_eq!(lifecycle.admit(ready(1)).await, Err(draining()));
        assert!(!lifecycle.in_flight.is_empty());
        lifecycle.cut();
        assert_eq!(stuck.await.unwrap(), Err(draining()));
        lifecycle.idle().await;
    }
}
