//! Snapshots of a map: whether one is put off, the memory that one takes, and the poses that are thinned after one.

use std::sync::atomic::{AtomicBool, Ordering};

use mrol_map::map::{MapName, MultiResolutionMap};
use mrol_store::MapFolder;

/// Whether the snapshot of a map is put off.
#[derive(Debug, Default)]
pub(super) struct Snapshots {
    /// A snapshot is due, and there is no room for it.
    is_put_off: AtomicBool,
}

impl Snapshots {
    /// There is no room for a snapshot: said once, tried again and again. Nothing is lost, since the journal is kept
    /// until there is one.
    pub(super) fn put_off(&self, map: &MapName, why: &str) {
        if !self.is_put_off.swap(true, Ordering::Relaxed) {
            tracing::warn!(%map, why, "a snapshot is put off: the journal grows instead");
        }
    }

    /// A snapshot was written.
    pub(super) fn note_written(&self) {
        self.is_put_off.store(false, Ordering::Relaxed);
    }
}

/// Bytes of memory that a snapshot of `map` takes while it is made: 55 to 70 % of the map's were measured.
pub(crate) fn snapshot_bytes(map: &MultiResolutionMap) -> u64 {
    map.memory_bytes() as u64 / 4 * 3
}

/// Thins the poses of `map` that undo reaches no more. Waits for the turn to change the map.
pub(super) fn thin(map: &MultiResolutionMap, folder: &MapFolder) {
    let before = folder.used().kept_from;
    map.committer().thin(before, &folder.settings().trajectory_spacing);
}
