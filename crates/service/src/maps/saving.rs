//! A map is saved by a snapshot; where the disk is nearly full, what is kept for undo is given up.

use std::time::Instant;

use super::hosted_map::HostedMap;
use super::snapshots::{snapshot_bytes, thin};
use crate::resources::ResourceBudget;
use mrol_store::{Snapshot, StoreError};

/// Which maps to write snapshots of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Saving {
    /// Maps that changed since their last snapshot.
    Changed,
    /// Maps that changed, with much journal or an old snapshot.
    Due,
}

impl HostedMap {
    /// True where a snapshot is to be written, if there is room for it. Does not wait for a disk.
    pub(crate) fn needs_saving(&self, which: Saving) -> bool {
        let Some(folder) = self.folder.as_ref().filter(|_| self.commit_queue.stopped().is_none()) else {
            return false;
        };
        self.map.revision() != folder.used().snapshot
            && (which == Saving::Changed || folder.snapshot_is_due())
    }

    /// Writes a snapshot where there is need and room for one; true when it did. A map whose journal failed is left as
    /// it is.
    pub(crate) fn save(&self, which: Saving, budget: &ResourceBudget) -> Result<bool, StoreError> {
        let Some(folder) = self.folder.as_ref().filter(|_| self.needs_saving(which)) else {
            return Ok(false);
        };
        let reserved = budget
            .check_to_shrink()
            .and_then(|()| budget.reserve_transient(snapshot_bytes(&self.map), "a snapshot"));
        let Ok(_reserved) =
            reserved.inspect_err(|no_room| self.snapshots.put_off(&self.name, &no_room.message))
        else {
            return Ok(false);
        };
        let (start, snapshot) = (Instant::now(), Snapshot::of(&self.map, self.uuid));
        let saved = folder.save(&snapshot, budget.file_bytes_max());
        // Its folder may go while it is written.
        if matches!(saved, Err(StoreError::Gone)) {
            return Ok(false);
        }
        if let Err(no_room @ StoreError::NoRoom { .. }) = &saved {
            self.snapshots.put_off(&self.name, &no_room.to_string());
            return Ok(false);
        }
        saved?;
        thin(&self.map, folder);
        self.snapshots.note_written();
        tracing::info!(map = %self.name, revision = snapshot.contents.revision, elapsed = ?start.elapsed(), "saved");
        Ok(true)
    }

    /// Gives up what is kept for undo alone, where the disk is so full that changes will be refused next.
    pub(crate) fn make_room(&self, budget: &ResourceBudget) -> Result<(), StoreError> {
        let Some(folder) = self.folder.as_ref().filter(|_| budget.is_disk_scarce()) else { return Ok(()) };
        match folder.give_up_undo() {
            Ok(true) => {
                tracing::warn!(map = %self.name, "the disk is nearly full: what was kept for undo is given up")
            }
            Ok(false) | Err(StoreError::Gone) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }
}
