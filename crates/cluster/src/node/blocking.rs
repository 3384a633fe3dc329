//! Questions to NATS, which block, and what is said where it does not answer.

use std::time::Duration;

use mrol_service::{Reason, ServiceError};
use tokio::task::{JoinError, spawn_blocking};

/// When to try again where NATS does not answer.
const TRY_AGAIN: Duration = Duration::from_secs(2);

/// Asks NATS, which blocks, away from the threads of the async runtime.
pub(super) async fn blocking<T: Send + 'static>(ask: impl FnOnce() -> T + Send + 'static) -> T {
    let asked: Result<T, JoinError> = spawn_blocking(ask).await;
    asked.unwrap_or_else(|failed| std::panic::resume_unwind(failed.into_panic()))
}

/// That NATS does not answer: nothing was changed.
pub(super) fn no_quorum(why: &dyn std::fmt::Display) -> ServiceError {
    try_again(&format!("NATS acknowledges nothing ({why})"))
}

/// That a request comes too early, or while too many nodes are gone: nothing was changed.
pub(super) fn try_again(why: &str) -> ServiceError {
    let message = format!("{why}: nothing was changed, try again");
    ServiceError::new(Reason::NoQuorum, message).retry_after(TRY_AGAIN)
}
