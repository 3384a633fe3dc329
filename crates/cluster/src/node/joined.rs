//! The connection to NATS, with all that the nodes keep there.

use std::time::Duration;

use mrol_service::{Reason, ServiceError};
use tokio::task::{JoinError, spawn_blocking};

use super::settings::NodeSettings;
use crate::bases::{BasePointers, BaseStore};
use crate::beats::Beats;
use crate::catalog::Catalog;
use crate::engine::{ConnectError, Engine, StreamError};

/// When to try again where NATS does not answer.
const TRY_AGAIN: Duration = Duration::from_secs(2);

/// The connection to NATS, with all that the nodes keep there.
#[derive(Debug, Clone)]
pub(super) struct Joined {
    pub(super) engine: Engine,
    pub(super) beats: Beats,
    pub(super) catalog: Catalog,
    pub(super) bases: BaseStore,
    pub(super) pointers: BasePointers,
}

/// Why a node does not begin.
#[derive(Debug, thiserror::Error)]
pub(super) enum NotJoined {
    #[error(transparent)]
    Connect(#[from] ConnectError),
    #[error(transparent)]
    Stream(#[from] StreamError),
}

impl Joined {
    /// Connects, and makes what is not there yet. Waits for some seconds; not for an async thread.
    pub(super) fn join(settings: &NodeSettings) -> Result<Self, NotJoined> {
        let engine = Engine::connect(&settings.engine)?;
        Ok(Self {
            beats: Beats::create(&engine)?,
            catalog: Catalog::create(&engine)?,
            bases: BaseStore::create(&engine)?,
            pointers: BasePointers::create(&engine)?,
            engine,
        })
    }
}

/// Asks NATS, which blocks, away from the threads of the async runtime.
pub(super) async fn blocking<T: Send + 'static>(ask: impl FnOnce() -> T + Send + 'static) -> T {
    let asked: Result<T, JoinError> = spawn_blocking(ask).await;
    asked.unwrap_or_else(|failed| std::panic::resume_unwind(failed.into_panic()))
}

/// That NATS does not answer: nothing was changed.
pub(super) fn no_quorum(why: &dyn std::fmt::Display) -> ServiceError {
    let message = format!("NATS acknowledges nothing ({why}): nothing was changed, try again");
    ServiceError::new(Reason::NoQuorum, message).retry_after(TRY_AGAIN)
}
