//! Progress of opening the maps.

use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicU64};

use super::error::StoreError;

/// Shared counters of the progress of opening maps; the readiness probe reads them. A clone is another handle on the
/// same counters.
#[derive(Debug, Clone, Default)]
pub struct OpeningProgress(Arc<Counters>);

#[derive(Debug, Default)]
struct Counters {
    bytes: AtomicU64,
    bytes_read: AtomicU64,
    maps: AtomicU64,
    maps_open: AtomicU64,
    cancelled: AtomicBool,
}

/// Progress of opening the maps, at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Opened {
    /// Bytes of the snapshots and journals that have to be read.
    pub bytes: u64,
    /// Bytes that have been read.
    pub bytes_read: u64,
    /// Number of maps.
    pub maps: u64,
    /// Number of maps that are open.
    pub maps_open: u64,
}

impl OpeningProgress {
    /// Returns the present progress.
    pub fn opened(&self) -> Opened {
        Opened {
            bytes: self.0.bytes.load(Relaxed),
            bytes_read: self.0.bytes_read.load(Relaxed),
            maps: self.0.maps.load(Relaxed),
            maps_open: self.0.maps_open.load(Relaxed),
        }
    }

    /// Cancels the opening.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Relaxed);
    }

    /// True once the opening was cancelled; long operations check it.
    pub(super) fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Relaxed)
    }

    /// # Errors
    /// `Cancelled` once the opening was cancelled.
    pub(super) fn check_wanted(&self) -> Result<(), StoreError> {
        if self.is_cancelled() { Err(StoreError::Cancelled) } else { Ok(()) }
    }

    /// Adds a map whose files have `bytes` bytes.
    pub(super) fn expect_map(&self, bytes: u64) {
        self.0.maps.fetch_add(1, Relaxed);
        self.0.bytes.fetch_add(bytes, Relaxed);
    }

    pub(super) fn read(&self, bytes: u64) {
        self.0.bytes_read.fetch_add(bytes, Relaxed);
    }

    /// Counts a map as open, for which nothing is left to be read.
    pub fn map_is_open(&self) {
        self.0.maps_open.fetch_add(1, Relaxed);
    }
}
