//! The folder of one map: snapshots, and the journal that goes on from them.
//!
//! ```text
//! office.UUID/snapshot-00000000000000000000.mrol      at that revision
//! office.UUID/snapshot-00000000000000004711.mrol
//! office.UUID/journal-00000000000000000001.log        from that revision on
//! office.UUID/journal-00000000000000004712.log
//! ```
//!
//! Two locks are held while files are written, that of the snapshots and that of the journal, and only who writes waits
//! for them. What readers ask is in [`Facts`].

mod facts;
mod observing;
mod opening;

pub use facts::{FolderUse, Pin};
pub use observing::{NotObserved, Observed};
pub use opening::OpenedMap;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use uuid::Uuid;

use super::folder::FolderPath;
use super::journal::{Journal, Record, SegmentFolder, SegmentedJournal};
use super::retention::UndoWindow;
use super::snapshot_files::{Sizes, forget_damaged, snapshot_name};
use super::{FileSystem, Snapshot, StoreError, StoreSettings, folder, snapshot};
use crate::map::WithdrawnScan;
use crate::sync::{Mutex, Rank};
use facts::Facts;

/// What keeps a map across crashes.
#[derive(Debug)]
pub struct MapFolder {
    files: Arc<dyn FileSystem>,
    uuid: Uuid,
    path: FolderPath,
    settings: StoreSettings,
    /// Where the journal's segments are.
    place: SegmentFolder,
    journal: Mutex<SegmentedJournal>,
    /// Held while a snapshot is written, or old ones are removed.
    snapshots: Mutex<()>,
    /// True once the folder was taken away. Changed while both locks are held.
    is_gone: AtomicBool,
    facts: Facts,
}

impl MapFolder {
    fn with(
        files: Arc<dyn FileSystem>,
        uuid: Uuid,
        path: FolderPath,
        settings: StoreSettings,
        journal: SegmentedJournal,
        snapshots: Vec<u64>,
        found: u64,
    ) -> Self {
        let folder = Self {
            files,
            uuid,
            path,
            settings,
            place: journal.place().clone(),
            facts: Facts::new(&journal, snapshots, found),
            journal: Mutex::new(Rank::Journal, journal),
            snapshots: Mutex::new(Rank::Snapshots, ()),
            is_gone: AtomicBool::default(),
        };
        folder.count_bytes();
        folder
    }

    /// Appends records; see [`Journal::append`].
    ///
    /// # Errors
    /// As there; `Gone` where the map was deleted.
    pub fn append(&self, records: &[&Record]) -> Result<u64, StoreError> {
        self.in_journal(|journal| journal.append(records))
    }

    /// Makes all that was appended durable; see [`Journal::sync`].
    ///
    /// # Errors
    /// As there; `Gone` where the map was deleted.
    pub fn sync(&self) -> Result<(), StoreError> {
        self.in_journal(Journal::sync)
    }

    /// Does something with the journal, and tells of it.
    fn in_journal<T>(
        &self,
        act: impl FnOnce(&mut SegmentedJournal) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let mut journal = self.journal.lock();
        self.check_there()?;
        let done = act(&mut journal);
        self.facts.tell(&journal);
        done
    }

    /// How the map is kept.
    pub fn settings(&self) -> &StoreSettings {
        &self.settings
    }

    /// Writes a snapshot of at most `bytes_max` beside the others, and forgets snapshots and journal that nobody needs any
    /// more. Where it cannot, a while passes before the next one is due. Nothing is written where there is a newer one.
    ///
    /// # Errors
    /// `NoRoom` for a larger one; when the system refuses, or the journal stopped. What was there is then there still.
    pub fn save(&self, snapshot: &Snapshot, bytes_max: u64) -> Result<(), StoreError> {
        let written = self.write(snapshot, bytes_max).inspect_err(|_| self.facts.tell_not_saved());
        self.count_bytes();
        written
    }

    /// Counts what is in the folder, so that who asks later need not look at the disk.
    fn count_bytes(&self) {
        self.facts.tell_bytes(folder::bytes_in(&*self.files, &self.path.get()));
    }

    fn write(&self, snapshot: &Snapshot, bytes_max: u64) -> Result<(), StoreError> {
        let revision = snapshot.contents.revision;
        // Before any lock: it takes seconds of a large map.
        let mut file = snapshot.encode().map_err(StoreError::io(self.path.get()))?;
        if file.len() as u64 > bytes_max {
            return Err(StoreError::NoRoom { bytes: file.len() as u64, bytes_max });
        }
        let _writing = self.snapshots.lock();
        self.check_there()?;
        if snapshot.uuid != self.uuid {
            let (found, expected) = (snapshot.uuid, self.uuid);
            return Err(StoreError::Foreign { path: self.path.get(), found, expected });
        }
        if revision < self.facts.newest_snapshot() {
            return Ok(());
        }
        // What the snapshot holds is durable in the journal before; what comes next begins a segment.
        let (head, appended) = self.in_journal(|journal| {
            journal.end_segment()?;
            Ok((journal.head(), journal.used().bytes))
        })?;
        // What was acknowledged while it was encoded is in the journal alone: who opens the map is to miss it.
        snapshot::set_head(&mut file, head.max(revision));
        folder::replace(&*self.files, &self.path.file(&snapshot_name(revision)), &file)?;
        self.facts.tell_saved(revision, appended);
        self.forget(self.undo_window(), snapshot.contents.trajectory.withdrawn())
    }

    /// True when there is much journal since the last snapshot, or that is old; not just after one that failed.
    pub fn snapshot_is_due(&self) -> bool {
        self.facts.snapshot_is_due(&self.settings)
    }

    /// Forgets what is kept for undo alone, for want of room on the disk; true where there was something. Where there is
    /// nothing, and for a while after it failed, nothing is done on the disk: this is asked again and again.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn give_up_undo(&self) -> Result<bool, StoreError> {
        if !self.facts.may_give_up() {
            return Ok(false);
        }
        let before = self.used().kept_from;
        let _writing = self.snapshots.lock();
        self.check_there()?;
        let forgotten = self.forget(UndoWindow { bytes_max: 0, ..self.undo_window() }, &[]);
        let gave_up = forgotten.is_ok() && self.used().kept_from != before;
        self.facts.tell_given_up(gave_up);
        self.count_bytes();
        forgotten.map(|()| gave_up)
    }

    fn undo_window(&self) -> UndoWindow {
        UndoWindow { revisions: self.settings.undo_revisions, bytes_max: self.settings.undo_bytes_max }
    }

    /// Removes the snapshots and the journal that nobody needs; the lock of the snapshots is held.
    fn forget(&self, window: UndoWindow, withdrawn: &[WithdrawnScan]) -> Result<(), StoreError> {
        let path = self.path.get();
        let sizes = Sizes::of(&*self.files, &path)?;
        let kept = self.facts.forget(window, withdrawn, &sizes);
        // The journal first: a snapshot without the journal behind it would be a gap, one more is not.
        if let Some(base) = kept.first() {
            self.in_journal(|journal| journal.truncate_before(base + 1))?;
            forget_damaged(&*self.files, &path, *base)?;
        }
        for revision in sizes.snapshots.keys().filter(|revision| !kept.contains(revision)) {
            let path = path.join(snapshot_name(*revision));
            self.files.remove(&path).map_err(StoreError::io(&path))?;
        }
        self.files.sync(&path).map_err(StoreError::io(&path))
    }

    /// How much is kept, and how. Waits for no disk.
    pub fn used(&self) -> FolderUse {
        self.facts.used()
    }

    /// The oldest revision that undo reaches, where the scans of `withdrawn` were taken out before. Waits for no disk.
    pub fn undo_from(&self, withdrawn: &[WithdrawnScan]) -> u64 {
        self.facts.undo_from(withdrawn)
    }

    /// True where the map was deleted, and this folder with it.
    pub fn is_gone(&self) -> bool {
        self.is_gone.load(Ordering::Acquire)
    }

    /// # Errors
    /// Where it is gone; asked while one of the locks is held.
    fn check_there(&self) -> Result<(), StoreError> {
        if self.is_gone() { Err(StoreError::Gone) } else { Ok(()) }
    }

    pub(super) fn uuid(&self) -> Uuid {
        self.uuid
    }

    pub(super) fn path(&self) -> PathBuf {
        self.path.get()
    }

    /// Gives the folder another name, for good. It may be used meanwhile, and waits.
    ///
    /// # Errors
    /// When the system refuses; it has then the name of before, as far as anybody can tell.
    pub(super) fn move_to(&self, to: &Path) -> Result<(), StoreError> {
        let _writing = self.snapshots.lock();
        let _appending = self.journal.lock();
        let from = self.path.get();
        self.rename(&from, to)?;
        if let Err(error) = self.files.sync(folder::folder_of(to)) {
            match self.rename(to, &from) {
                Ok(()) => return Err(StoreError::io(&from)(error)),
                Err(_) => self.path.set(to.to_owned()),
            }
            return Err(StoreError::io(&from)(error));
        }
        self.path.set(to.to_owned());
        Ok(())
    }

    /// Gives the folder a name under which nobody looks for it; nothing is written there any more. Not durable before
    /// the folder above is synced.
    ///
    /// # Errors
    /// When the system refuses; it is then as it was.
    pub(super) fn take_away(&self, to: &Path) -> Result<(), StoreError> {
        let _writing = self.snapshots.lock();
        let _appending = self.journal.lock();
        self.check_there()?;
        self.rename(&self.path.get(), to)?;
        self.is_gone.store(true, Ordering::Release);
        Ok(())
    }

    /// Renames, and looks what became of it where the system says that it failed.
    fn rename(&self, from: &Path, to: &Path) -> Result<(), StoreError> {
        match self.files.rename(from, to) {
            Err(_) if self.files.list(from).is_err() && self.files.list(to).is_ok() => Ok(()),
            renamed => renamed.map_err(StoreError::io(from)),
        }
    }
}
