//! The maps are opened while the server answers: each is served as soon as it is open.

use tokio::sync::watch;
use tokio::task::{JoinError, JoinHandle, spawn_blocking};

use super::error::ServerError;
use crate::admission::Lifecycle;
use crate::grpc::Health;
use mrol_service::{MapService, ServiceError};
use mrol_store::OpeningProgress;

/// How far the maps are found and opened; once this is dropped, that ends.
#[derive(Debug, Default)]
pub(super) struct Wanted(OpeningProgress);

impl Wanted {
    /// How far it has come.
    pub(super) fn progress(&self) -> &OpeningProgress {
        &self.0
    }
}

impl Drop for Wanted {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// The opening of the maps in the background. Once it is through, the server is healthy, unless it is a node that is
/// behind the others. Dropped, it ends.
pub(super) struct Opening {
    _wanted: Wanted,
    work: JoinHandle<Result<(), ServiceError>>,
    health: Health,
    is_behind: watch::Receiver<bool>,
}

impl Opening {
    /// Begins to open the maps of `service`, which was begun with the progress of `wanted`. Where there are none, the
    /// server is healthy at once.
    pub(super) async fn begin(
        service: MapService,
        wanted: Wanted,
        health: Health,
        lifecycle: &Lifecycle,
    ) -> Self {
        let is_behind = lifecycle.behind();
        let is_healthy = service.opening().is_none() && !*is_behind.borrow();
        health.set(is_healthy).await;
        Self { _wanted: wanted, work: spawn_blocking(move || service.open_maps()), health, is_behind }
    }

    /// Says whether the server is healthy once all maps are open. Ends only where that fails, with the reason.
    pub(super) async fn failed(&mut self) -> ServerError {
        match (&mut self.work).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return ServerError::Open(error),
            Err(panic) => return panicked(&panic),
        }
        loop {
            let is_behind = *self.is_behind.borrow_and_update();
            self.health.set(!is_behind).await;
            if self.is_behind.changed().await.is_err() {
                break;
            }
        }
        std::future::pending().await
    }

    /// Says that the server is not healthy any more, and opens no further map.
    pub(super) async fn end(self) {
        self.health.set(false).await;
    }
}

/// The opening panicked.
pub(super) fn panicked(panic: &JoinError) -> ServerError {
    ServerError::Stopped("opening the maps", panic.to_string())
}
