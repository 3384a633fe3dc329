//! Facts about a map's folder, kept in memory so that reading them never waits for a disk.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::retention::{self, UndoWindow};
use super::snapshot_files::Sizes;
use crate::journal::{JournalUse, SegmentedJournal};
use crate::settings::StoreSettings;
use mrol_map::map::WithdrawnChange;
use mrol_map::sync::{Mutex, MutexGuard, Rank};

/// Least time from a failed snapshot to the next attempt, and from a failed removal of what is kept for undo to the
/// next attempt: a snapshot takes a while of a thread, and a full disk does not empty at once.
const AGAIN_AFTER: Duration = Duration::from_secs(5);

/// Statistics of a map's folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FolderUse {
    /// The last revision that is known to be durable.
    pub durable: u64,
    /// Revision of the newest snapshot.
    pub snapshot: u64,
    /// First revision from which on all changes are kept.
    pub kept_from: u64,
    /// Statistics of the journal.
    pub journal: JournalUse,
    /// Time since the newest snapshot was written, or since the folder was opened where that was later.
    pub snapshot_age: Duration,
    /// Number of snapshots that could not be written since the folder was opened.
    pub snapshot_failures: u64,
    /// Bytes of the files in the folder.
    pub disk_bytes: u64,
}

/// Shared facts about a folder. Writers update them after each step; a clone is another handle to the same facts.
#[derive(Debug, Clone)]
pub(crate) struct Facts(Arc<Mutex<Known>>);

#[derive(Debug)]
struct Known {
    head: u64,
    durable: u64,
    journal: JournalUse,
    /// First revisions of the segments, ascending.
    segments: Vec<u64>,
    /// Revisions of the snapshots, ascending.
    snapshots: Vec<u64>,
    /// Revisions from which the journal is being read; see [`Pin`].
    pinned: Vec<u64>,
    saved: Saved,
    /// Time of the last failed attempt to remove what is kept for undo.
    gave_up_in_vain: Option<Instant>,
    /// Bytes of the folder when they were last counted, less those that had been appended to the journal by then; wraps
    /// around.
    counted_bytes: u64,
}

/// Amount of journal after the newest snapshot, and since when.
#[derive(Debug, Clone, Copy)]
struct Saved {
    at: Instant,
    /// Bytes of journal after the snapshot that were found at the start.
    found: u64,
    /// Bytes that had been appended when the snapshot was written.
    appended: u64,
    /// Time at which the next snapshot could not be written.
    failed: Option<Instant>,
    /// Number of snapshots that could not be written since the start.
    failures: u64,
}

/// Guard that keeps a snapshot, and the journal from it on, until it is dropped.
#[derive(Debug)]
pub struct Pin {
    facts: Facts,
    pub(super) snapshot: u64,
}

impl Drop for Pin {
    fn drop(&mut self) {
        let mut known = self.facts.lock();
        if let Some(at) = known.pinned.iter().position(|&pinned| pinned == self.snapshot) {
            known.pinned.swap_remove(at);
        }
    }
}

impl Facts {
    pub(super) fn new(journal: &SegmentedJournal, snapshots: Vec<u64>, found: u64) -> Self {
        let saved = Saved { at: Instant::now(), found, appended: 0, failed: None, failures: 0 };
        let known = Known {
            head: journal.head(),
            durable: journal.durable(),
            journal: journal.used(),
            segments: journal.segments().to_vec(),
            snapshots,
            pinned: Vec::new(),
            saved,
            gave_up_in_vain: None,
            counted_bytes: 0,
        };
        Self(Arc::new(Mutex::new(Rank::Brief, known)))
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.0.lock()
    }

    /// Records that the journal was written.
    pub(super) fn tell(&self, journal: &SegmentedJournal) {
        let mut known = self.lock();
        (known.head, known.durable, known.journal) = (journal.head(), journal.durable(), journal.used());
        known.segments.clear();
        known.segments.extend_from_slice(journal.segments());
    }

    /// Records that the snapshot of `revision` was written, when `appended` bytes of journal had been appended.
    pub(super) fn note_saved(&self, revision: u64, appended: u64) {
        let mut known = self.lock();
        let at = known.snapshots.partition_point(|&snapshot| snapshot < revision);
        if known.snapshots.get(at) != Some(&revision) {
            known.snapshots.insert(at, revision);
        }
        let failures = known.saved.failures;
        known.saved = Saved { at: Instant::now(), found: 0, appended, failed: None, failures };
    }

    /// Records that a snapshot could not be written.
    pub(super) fn note_not_saved(&self) {
        let mut known = self.lock();
        known.saved.failed = Some(Instant::now());
        known.saved.failures += 1;
    }

    /// True where something is kept for undo alone and not being read; false for a while after it could not be removed.
    pub(super) fn may_give_up(&self) -> bool {
        let known = self.lock();
        if known.gave_up_in_vain.is_some_and(|then| then.elapsed() < AGAIN_AFTER) {
            return false;
        }
        let for_undo = known.snapshots.len().saturating_sub(retention::FOR_RECOVERY);
        let can_go = |snapshot: &&u64| !known.pinned.contains(snapshot);
        let kept = known.snapshots[for_undo..].iter().chain(&known.pinned).min();
        known.snapshots[..for_undo].iter().any(|snapshot| can_go(&snapshot))
            || kept.is_some_and(|base| known.segments.partition_point(|first| *first <= base + 1) > 1)
    }

    /// Records whether what is kept for undo alone could be removed.
    pub(super) fn note_given_up(&self, gave_up: bool) {
        self.lock().gave_up_in_vain = (!gave_up).then(Instant::now);
    }

    /// Records the size of the folder's files.
    pub(super) fn note_bytes(&self, bytes: u64) {
        let mut known = self.lock();
        known.counted_bytes = bytes.wrapping_sub(known.journal.bytes);
    }

    pub(super) fn newest_snapshot(&self) -> u64 {
        self.lock().snapshots.last().copied().unwrap_or_default()
    }

    pub(super) fn snapshot_is_due(&self, settings: &StoreSettings) -> bool {
        let known = self.lock();
        let Saved { at, found, appended, failed, .. } = known.saved;
        if failed.is_some_and(|failed| failed.elapsed() < AGAIN_AFTER) {
            return false;
        }
        let bytes = found + known.journal.bytes - appended;
        bytes >= settings.snapshot_journal_bytes || at.elapsed() >= settings.snapshot_interval
    }

    pub(super) fn used(&self) -> FolderUse {
        let known = self.lock();
        let oldest = known.snapshots.first().copied().unwrap_or_default();
        let snapshot = known.snapshots.last().copied().unwrap_or_default();
        let tail = known.segments.first().copied();
        let kept_from = tail.map_or(known.head + 1, |tail| tail.max(oldest + 1));
        FolderUse {
            durable: known.durable,
            snapshot,
            kept_from,
            journal: known.journal,
            snapshot_age: known.saved.at.elapsed(),
            snapshot_failures: known.saved.failures,
            disk_bytes: known.counted_bytes.wrapping_add(known.journal.bytes),
        }
    }

    /// Returns the first revisions of the segments, and the head of the journal.
    pub(super) fn journal(&self) -> (Vec<u64>, u64) {
        let known = self.lock();
        (known.segments.clone(), known.head)
    }

    /// The oldest revision that undo can return to, where the scans of `withdrawn` were removed before.
    pub(super) fn undo_from(&self, withdrawn: &[WithdrawnChange]) -> u64 {
        let known = self.lock();
        let fits = |snapshot: &&u64| known.is_base(**snapshot, withdrawn);
        known.snapshots.iter().find(fits).map_or(known.head, |base| *base) + 1
    }

    /// Pins the newest snapshot that an undo of `scans` can begin with.
    pub(super) fn pin_base_of(&self, scans: &[u64], withdrawn: &[WithdrawnChange]) -> Option<Pin> {
        let first = *scans.iter().min()?;
        let mut known = self.lock();
        let fits = |&&snapshot: &&u64| snapshot < first && known.is_base(snapshot, withdrawn);
        let snapshot = known.snapshots.iter().rfind(fits).copied()?;
        known.pinned.push(snapshot);
        drop(known);
        Some(Pin { facts: self.clone(), snapshot })
    }

    /// Drops snapshots that are no longer needed, so that no reader begins with them from now on; returns those that
    /// are kept.
    pub(super) fn forget(
        &self,
        window: UndoWindow,
        withdrawn: &[WithdrawnChange],
        sizes: &Sizes,
    ) -> Vec<u64> {
        let mut known = self.lock();
        let head = known.snapshots.last().copied().unwrap_or_default();
        let mut kept = retention::kept_within(&known.snapshots, head, window, withdrawn, sizes);
        kept.extend_from_slice(&known.pinned);
        kept.sort_unstable();
        kept.dedup();
        if let Some(base) = kept.first() {
            let needed = known.segments.partition_point(|first| *first <= base + 1).saturating_sub(1);
            known.segments.drain(..needed);
        }
        known.snapshots.clone_from(&kept);
        kept
    }
}

impl Known {
    /// True of a snapshot that undo can begin with: the journal is kept from there on, and it holds nothing of a scan
    /// that was withdrawn later.
    fn is_base(&self, snapshot: u64, withdrawn: &[WithdrawnChange]) -> bool {
        let is_kept = self.segments.first().is_some_and(|tail| *tail <= snapshot + 1);
        is_kept && retention::is_base(snapshot, withdrawn)
    }
}
