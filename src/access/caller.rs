//! The caller of a request.

use std::sync::Arc;

use super::allowance::Allowance;
use super::key::Key;
use mrol_service::{AllowedMaps, AllowedScans, ServiceError};

/// The caller of a request: the holder of a key, or anybody.
#[derive(Debug, Clone)]
pub struct Caller {
    key: Option<Arc<Key>>,
    allowed_maps: AllowedMaps,
}

impl Caller {
    /// A caller without a key, that may name the allowed maps.
    pub(super) fn without_key(allowed_maps: AllowedMaps) -> Self {
        Self { key: None, allowed_maps }
    }

    /// The holder of a key.
    pub(super) fn with(key: Arc<Key>) -> Self {
        Self { allowed_maps: key.allowed_maps.clone(), key: Some(key) }
    }

    /// The name of the caller's key, for the log and metrics.
    pub fn name(&self) -> Option<&str> {
        self.key.as_ref().map(|key| key.name.as_str())
    }

    /// The maps that the caller may name.
    pub fn allowed_maps(&self) -> &AllowedMaps {
        &self.allowed_maps
    }

    /// The scans that the caller may send and undo.
    pub fn scans(&self) -> AllowedScans {
        self.key.as_ref().map(|key| key.allowed_scans()).unwrap_or_default()
    }

    /// What is left of the bounds of the caller's key.
    pub fn allowance(&self) -> Option<&Arc<Allowance>> {
        self.key.as_ref().map(|key| &key.allowance)
    }

    /// True of the holder of a key, which may end.
    pub fn has_key(&self) -> bool {
        self.key.is_some()
    }

    /// Waits until the caller's key counts no longer: what was begun with it, and goes on and on, ends with this.
    pub fn withdrawn(&self) -> impl Future<Output = ServiceError> + Send + 'static {
        let key = self.key.clone();
        async move {
            let Some(key) = key else { return std::future::pending().await };
            key.end.token().cancelled().await;
            key.ended()
        }
    }

    /// What comes of `work` while the caller's key counts.
    ///
    /// # Errors
    /// Those of `work`; `Unauthenticated` as soon as the key counts no longer: the work is dropped, as it is where its
    /// client has gone.
    pub async fn while_valid<T>(
        &self,
        work: impl Future<Output = Result<T, ServiceError>>,
    ) -> Result<T, ServiceError> {
        if !self.has_key() {
            return work.await;
        }
        tokio::select! {
            biased;
            ended = self.withdrawn() => Err(ended),
            done = work => done,
        }
    }
}
