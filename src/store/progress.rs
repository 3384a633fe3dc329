//! How far the opening of the maps has come.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

use super::StoreError;

/// Counted by who opens maps, read by who asks whether the server is ready.
#[derive(Debug, Default)]
pub struct OpeningProgress {
    bytes: AtomicU64,
    bytes_read: AtomicU64,
    maps: AtomicU64,
    maps_open: AtomicU64,
    cancelled: AtomicBool,
}

/// How far it has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Opened {
    /// Bytes of the snapshots and journals that have to be read.
    pub bytes: u64,
    /// Bytes that were read.
    pub bytes_read: u64,
    /// Maps there are.
    pub maps: u64,
    /// Maps that are open.
    pub maps_open: u64,
}

impl OpeningProgress {
    /// How far it has come.
    pub fn opened(&self) -> Opened {
        Opened {
            bytes: self.bytes.load(Relaxed),
            bytes_read: self.bytes_read.load(Relaxed),
            maps: self.maps.load(Relaxed),
            maps_open: self.maps_open.load(Relaxed),
        }
    }

    /// Ends the opening early: nobody wants the maps any more.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// True where nobody wants the maps any more: what long work of an opening asks.
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Relaxed)
    }

    /// # Errors
    /// Where nobody wants the maps any more.
    pub(super) fn check_wanted(&self) -> Result<(), StoreError> {
        if self.is_cancelled() { Err(StoreError::Cancelled) } else { Ok(()) }
    }

    /// One more map of so many bytes will be opened.
    pub(super) fn expect_map(&self, bytes: u64) {
        self.maps.fetch_add(1, Relaxed);
        self.bytes.fetch_add(bytes, Relaxed);
    }

    pub(super) fn read(&self, bytes: u64) {
        self.bytes_read.fetch_add(bytes, Relaxed);
    }

    pub(super) fn map_is_open(&self) {
        self.maps_open.fetch_add(1, Relaxed);
    }
}
