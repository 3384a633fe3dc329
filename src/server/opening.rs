//! The maps are opened while the server answers: each is served as soon as it is open.

use tokio::task::{JoinError, JoinHandle, spawn_blocking};

use super::error::ServerError;
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

/// The opening of the maps in the background; once it is through, the server is healthy. Dropped, it ends.
pub(super) struct Opening {
    _wanted: Wanted,
    work: JoinHandle<Result<(), ServiceError>>,
    health: Health,
}

impl Opening {
    /// Begins to open the maps of `service`, which was begun with the progress of `wanted`. Where there are none, the
    /// server is healthy at once.
    pub(super) async fn begin(service: MapService, wanted: Wanted, health: Health) -> Self {
        match service.opening() {
            None => health.set_serving().await,
            Some(_) => health.set_not_serving().await,
        }
        Self { _wanted: wanted, work: spawn_blocking(move || service.open_maps()), health }
    }

    /// Says that the server is healthy once all maps are open. Ends only where that fails, with the reason.
    pub(super) async fn failed(&mut self) -> ServerError {
        match (&mut self.work).await {
            Ok(Ok(())) => self.health.set_serving().await,
            Ok(Err(error)) => return ServerError::Open(error),
            Err(panic) => return panicked(&panic),
        }
        std::future::pending().await
    }

    /// Says that the server is not healthy any more, and opens no further map.
    pub(super) async fn end(self) {
        self.health.set_not_serving().await;
    }
}

/// The opening panicked.
pub(super) fn panicked(panic: &JoinError) -> ServerError {
    ServerError::Stopped("opening the maps", panic.to_string())
}
