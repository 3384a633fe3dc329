//! Who asks.

use std::sync::Arc;

use super::Key;
use crate::service::{ErrorCode, MapReach, ServiceError};

/// Who asks for something: the holder of a key, or anybody.
#[derive(Debug, Clone)]
pub struct Caller {
    key: Option<Arc<Key>>,
    reach: MapReach,
}

impl Caller {
    /// Somebody without a key, who may name the maps of `reach`.
    pub(super) fn without_key(reach: MapReach) -> Self {
        Self { key: None, reach }
    }

    /// The holder of a key.
    pub(super) fn with(key: Arc<Key>) -> Self {
        Self { reach: key.reach.clone(), key: Some(key) }
    }

    /// The name of the caller's key, for the log and metrics.
    pub fn name(&self) -> Option<&str> {
        self.key.as_ref().map(|key| key.name.as_str())
    }

    /// The maps that the caller may name.
    pub fn reach(&self) -> &MapReach {
        &self.reach
    }

    /// Waits until the caller's key counts no longer: what was begun with it, and goes on and on, ends with this.
    pub async fn withdrawn(&self) -> ServiceError {
        let Some(key) = &self.key else { return std::future::pending().await };
        key.withdrawn.cancelled().await;
        let message = format!("key {} was withdrawn or changed", key.name);
        ServiceError::new(ErrorCode::Unauthenticated, "key_withdrawn", message)
    }
}
