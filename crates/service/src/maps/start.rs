//! All maps are opened at a start, side by side.

use std::sync::Arc;

use parking_lot::Mutex;

use super::catalog::Catalog;
use super::opening::{maps_at_once, not_stored};
use super::sleeping::OPENING_MAX;
use crate::error::{Reason, ServiceError};
use mrol_map::map::MapName;
use mrol_store::{Opened, StoreError};
use tokio::time::timeout;

impl Catalog {
    /// Opens the maps of the data folder, side by side; each is served as soon as it is open, and one that fails keeps
    /// no other back. `opened` is called of each. Waits for the disk.
    ///
    /// # Errors
    /// `Cancelled` once the progress with which the catalog was made was cancelled.
    pub(crate) fn open_all(&self, opened: impl Fn(&MapName) + Sync) -> Result<(), ServiceError> {
        let all: Vec<_> =
            self.maps.read().asleep.iter().map(|(name, it)| (name.clone(), Arc::clone(it))).collect();
        let count = maps_at_once().min(all.len());
        let rest = Mutex::new(all.into_iter());
        let work = || {
            loop {
                let next = rest.lock().next();
                let Some((name, asleep)) = next else { return Ok(()) };
                let opening = Arc::clone(&asleep.opening).blocking_lock_owned();
                let is_new = self.open_asleep(&name, &asleep, &self.progress)?;
                drop(opening);
                // Or a request was faster.
                if is_new {
                    opened(&name);
                }
            }
        };
        side_by_side(count, work).map_err(not_stored)?;
        self.are_open.send_replace(true);
        Ok(())
    }

    /// Waits until every map of the data folder was opened, or could not be.
    ///
    /// # Errors
    /// `CatalogBusy` where that takes longer than [`OPENING_MAX`].
    pub(crate) async fn all_open(&self) -> Result<(), ServiceError> {
        let mut are_open = self.are_open.subscribe();
        let opened = timeout(OPENING_MAX, are_open.wait_for(|are_open| *are_open)).await;
        // The sender is there as long as this is.
        opened.map(drop).map_err(|_| {
            let Opened { maps, maps_open, .. } = self.progress.opened();
            let message =
                format!("{maps_open} of {maps} maps are open: ask for one, or for all once /readyz is ready");
            ServiceError::new(Reason::CatalogBusy, message).retry_after(OPENING_MAX)
        })
    }

    /// How far the maps of the data folder are opened; none once each was opened, or could not be.
    pub(crate) fn opening(&self) -> Option<Opened> {
        (!*self.are_open.borrow()).then(|| self.progress.opened())
    }
}

/// Does `work` on so many threads, none of which is the caller's: that may be one of the async runtime.
fn side_by_side(count: usize, work: impl Fn() -> Result<(), StoreError> + Sync) -> Result<(), StoreError> {
    std::thread::scope(|scope| {
        let spawn = |number: usize| {
            let thread = std::thread::Builder::new().name(format!("mrol-opening-{number}"));
            // Where the system has no thread left, those that are there do it.
            thread.spawn_scoped(scope, &work).ok()
        };
        let threads: Vec<_> = (0..count).filter_map(spawn).collect();
        if threads.is_empty() {
            return work();
        }
        let joined = threads.into_iter().map(|thread| match thread.join() {
            Ok(ended) => ended,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        joined.fold(Ok(()), Result::and)
    })
}
