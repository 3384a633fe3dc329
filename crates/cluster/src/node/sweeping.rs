//! What nodes that went down left in the store of bases is deleted.

use std::time::{Duration, Instant};

use super::blocking::blocking;
use crate::bases::Orphans;
use crate::store::ClusterStore;

/// Deletes what nothing points to in the store of bases, if it was there at two looks.
pub(super) struct Sweeping {
    joined: ClusterStore,
    every: Duration,
    looked: Instant,
    found: Orphans,
}

impl Sweeping {
    pub(super) fn of(joined: ClusterStore, every: Duration) -> Self {
        Self { joined, every, looked: Instant::now(), found: Orphans::default() }
    }

    /// Looks, where it is time for that.
    pub(super) async fn look(&mut self) {
        if self.looked.elapsed() < self.every {
            return;
        }
        self.looked = Instant::now();
        let (joined, before) = (self.joined.clone(), std::mem::take(&mut self.found));
        match blocking(move || joined.bases.sweep(&joined.pointers, &before)).await {
            Ok(found) => self.found = found,
            Err(error) => tracing::warn!(%error, "the store of bases was not swept: it is tried again"),
        }
    }
}
