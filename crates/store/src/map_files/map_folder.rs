//! A map's folder in use: changes are appended, snapshots written, and what is no longer needed removed.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use uuid::Uuid;

use super::facts::{Facts, FolderUse};
use super::retention::UndoWindow;
use super::snapshot_files::{Sizes, forget_damaged, snapshot_name, unneeded_parts};
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder::{self, FolderPath};
use crate::journal::{Record, SegmentFolder, SegmentedJournal};
use crate::settings::StoreSettings;
use crate::snapshots::{self, Snapshot};
use crate::viewpoint_parts::{ViewpointParts, part_names, section_of};
use mrol_map::map::WithdrawnChange;
use mrol_map::sync::{Mutex, Rank};

/// A map's folder: keeps the map across crashes.
#[derive(Debug)]
pub struct MapFolder {
    pub(crate) files: Arc<dyn FileSystem>,
    uuid: Uuid,
    pub(crate) path: FolderPath,
    settings: StoreSettings,
    /// Location of the journal's segments.
    pub(crate) place: SegmentFolder,
    journal: Mutex<SegmentedJournal>,
    /// The parts that the newest snapshot names. Held while a snapshot is written, or old ones are removed.
    snapshots: Mutex<ViewpointParts>,
    /// True once the folder was deleted. Changed while both locks are held.
    is_gone: AtomicBool,
    pub(crate) facts: Facts,
}

/// What a folder has when it is opened.
pub(crate) struct Found {
    /// Revisions of the snapshots, ascending.
    pub(crate) snapshots: Vec<u64>,
    pub(crate) parts: ViewpointParts,
    /// Bytes of journal after the newest snapshot.
    pub(crate) journal_bytes: u64,
}

impl MapFolder {
    pub(crate) fn with(
        files: Arc<dyn FileSystem>,
        uuid: Uuid,
        path: FolderPath,
        settings: StoreSettings,
        journal: SegmentedJournal,
        found: Found,
    ) -> Self {
        let Found { snapshots, parts, journal_bytes } = found;
        let folder = Self {
            files,
            uuid,
            path,
            settings,
            place: journal.place().clone(),
            facts: Facts::new(&journal, snapshots, journal_bytes),
            journal: Mutex::new(Rank::Journal, journal),
            snapshots: Mutex::new(Rank::Snapshots, parts),
            is_gone: AtomicBool::default(),
        };
        folder.count_bytes();
        folder
    }

    /// Appends records; see [`SegmentedJournal::append`].
    ///
    /// # Errors
    /// As for [`SegmentedJournal::append`]; `Gone` where the map was deleted.
    pub fn append(&self, records: &[&Record]) -> Result<u64, StoreError> {
        self.in_journal(|journal| journal.append(records))
    }

    /// Makes everything appended so far durable; see [`SegmentedJournal::sync`].
    ///
    /// # Errors
    /// As for [`SegmentedJournal::sync`]; `Gone` where the map was deleted.
    pub fn sync(&self) -> Result<(), StoreError> {
        self.in_journal(SegmentedJournal::sync)
    }

    /// Runs `act` on the journal, and updates the facts.
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

    /// Settings of the store.
    pub fn settings(&self) -> &StoreSettings {
        &self.settings
    }

    /// Writes a snapshot of at most `bytes_max` bytes, and removes snapshots and journal that are no longer needed.
    /// After a failure the next snapshot is due only after a while. Nothing is written where there is a newer snapshot.
    ///
    /// # Errors
    /// `NoRoom` for a larger one; when the system refuses, or the journal stopped. What was there is then still there.
    pub fn save(&self, snapshot: &Snapshot, bytes_max: u64) -> Result<(), StoreError> {
        let written = self.write(snapshot, bytes_max).inspect_err(|_| self.facts.note_not_saved());
        self.count_bytes();
        written
    }

    /// Counts the bytes in the folder, so that later queries need not read the disk.
    fn count_bytes(&self) {
        self.facts.note_bytes(folder::bytes_in(&*self.files, &self.path.get()));
    }

    fn write(&self, snapshot: &Snapshot, bytes_max: u64) -> Result<(), StoreError> {
        let revision = snapshot.contents.revision;
        // Done before any lock is taken: it takes seconds for a large map.
        let mut file = snapshot.encode_without_viewpoints().map_err(StoreError::io(self.path.get()))?;
        let mut parts = self.snapshots.lock();
        self.check_there()?;
        if snapshot.uuid != self.uuid {
            let (found, expected) = (snapshot.uuid, self.uuid);
            return Err(StoreError::Foreign { path: self.path.get(), found, expected });
        }
        if revision < self.facts.newest_snapshot() {
            return Ok(());
        }
        let plan = parts.plan(&snapshot.contents.viewpoints);
        let new_part = plan.new_part(&snapshot.contents.viewpoints, self.uuid);
        let (written, part) = new_part.map_err(StoreError::io(self.path.get()))?.unzip();
        let bytes = (file.len() + 2 * part.as_ref().map_or(0, Vec::len)) as u64;
        if bytes > bytes_max {
            return Err(StoreError::NoRoom { bytes, bytes_max });
        }
        // Everything in the snapshot is durable in the journal first; the next record begins a segment.
        let (head, appended) = self.in_journal(|journal| {
            journal.end_segment()?;
            Ok((journal.head(), journal.used().bytes))
        })?;
        // What was acknowledged during the encoding is only in the journal: opening the map must notice where that is
        // missing.
        snapshots::complete(&mut file, head.max(revision), &section_of(&plan.uses(written.as_ref())));
        parts.use_up_number(&plan);
        let write = || {
            if let (Some(written), Some(part)) = (&written, &part) {
                for name in part_names(written.number()) {
                    folder::replace(&*self.files, &self.path.file(&name), part)?;
                }
            }
            folder::replace(&*self.files, &self.path.file(&snapshot_name(revision)), &file)
        };
        // A part that no snapshot names would take the space that is missing.
        write().inspect_err(|_| drop(self.forget_parts(&parts)))?;
        parts.note_written(plan, written);
        self.facts.note_saved(revision, appended);
        self.forget(self.undo_window(), snapshot.contents.trajectory.withdrawn(), &parts)
    }

    /// True when there is much journal since the last snapshot, or that is old; false just after a failure.
    pub fn snapshot_is_due(&self) -> bool {
        self.facts.snapshot_is_due(&self.settings)
    }

    /// Removes what is kept for undo alone, when the disk is short of space; true where there was something. Where
    /// there is nothing, and for a while after a failure, the disk is not touched: this is called again and again.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn give_up_undo(&self) -> Result<bool, StoreError> {
        if !self.facts.may_give_up() {
            return Ok(false);
        }
        let before = self.used().kept_from;
        let parts = self.snapshots.lock();
        self.check_there()?;
        let forgotten = self.forget(UndoWindow { bytes_max: 0, ..self.undo_window() }, &[], &parts);
        let gave_up = forgotten.is_ok() && self.used().kept_from != before;
        self.facts.note_given_up(gave_up);
        self.count_bytes();
        forgotten.map(|()| gave_up)
    }

    fn undo_window(&self) -> UndoWindow {
        UndoWindow { revisions: self.settings.undo_revisions, bytes_max: self.settings.undo_bytes_max }
    }

    /// Removes snapshots and journal that are no longer needed, and the parts that only those named; `parts` are those
    /// of the newest, whose lock the caller holds.
    fn forget(
        &self,
        window: UndoWindow,
        withdrawn: &[WithdrawnChange],
        parts: &ViewpointParts,
    ) -> Result<(), StoreError> {
        let path = self.path.get();
        let sizes = Sizes::of(&*self.files, &path)?;
        let kept = self.facts.forget(window, withdrawn, &sizes);
        // The journal first: a crash between the two then leaves a snapshot too many, which is no gap.
        if let Some(base) = kept.first() {
            self.in_journal(|journal| journal.truncate_before(base + 1))?;
            forget_damaged(&*self.files, &path, *base)?;
        }
        for revision in sizes.snapshots.keys().filter(|revision| !kept.contains(revision)) {
            let path = path.join(snapshot_name(*revision));
            self.files.remove(&path).map_err(StoreError::io(&path))?;
        }
        self.files.sync(&path).map_err(StoreError::io(&path))?;
        self.forget_parts(parts)
    }

    /// Removes the parts that no snapshot names; those of the newest snapshot are `parts`. What was removed of
    /// snapshots is durable before: after a crash none is there that names a part which is not.
    fn forget_parts(&self, parts: &ViewpointParts) -> Result<(), StoreError> {
        let path = self.path.get();
        let unneeded = unneeded_parts(&*self.files, &path, parts.numbers())?;
        for number in &unneeded {
            for path in part_names(*number).map(|name| path.join(name)) {
                match self.files.remove(&path) {
                    // The copy of one that was cut short.
                    Err(missing) if missing.kind() == std::io::ErrorKind::NotFound => {}
                    removed => removed.map_err(StoreError::io(&path))?,
                }
            }
        }
        if unneeded.is_empty() {
            return Ok(());
        }
        self.files.sync(&path).map_err(StoreError::io(&path))
    }

    /// Statistics of the folder. Does not wait for a disk.
    pub fn used(&self) -> FolderUse {
        self.facts.used()
    }

    /// The oldest revision that undo can return to, where the scans of `withdrawn` were removed before. Does not wait
    /// for a disk.
    pub fn undo_from(&self, withdrawn: &[WithdrawnChange]) -> u64 {
        self.facts.undo_from(withdrawn)
    }

    /// True where the map, and this folder with it, was deleted.
    pub fn is_gone(&self) -> bool {
        self.is_gone.load(Ordering::Acquire)
    }

    /// # Errors
    /// `Gone` where the folder was deleted. The caller holds one of the locks.
    fn check_there(&self) -> Result<(), StoreError> {
        if self.is_gone() { Err(StoreError::Gone) } else { Ok(()) }
    }

    pub(crate) fn uuid(&self) -> Uuid {
        self.uuid
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.path.get()
    }

    /// Renames the folder, durably. It may be in use; users wait.
    ///
    /// # Errors
    /// When the system refuses; as far as can be known, the folder then has its former name.
    pub(crate) fn move_to(&self, to: &Path) -> Result<(), StoreError> {
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

    /// Renames the folder so that it is no longer found; nothing is written there any more. Not durable before the
    /// parent folder is synced.
    ///
    /// # Errors
    /// When the system refuses; it is then as it was.
    pub(crate) fn take_away(&self, to: &Path) -> Result<(), StoreError> {
        let _writing = self.snapshots.lock();
        let _appending = self.journal.lock();
        self.check_there()?;
        self.rename(&self.path.get(), to)?;
        self.is_gone.store(true, Ordering::Release);
        Ok(())
    }

    /// Renames the folder, and checks the result where the system reports a failure.
    fn rename(&self, from: &Path, to: &Path) -> Result<(), StoreError> {
        match self.files.rename(from, to) {
            Err(_) if self.files.list(from).is_err() && self.files.list(to).is_ok() => Ok(()),
            renamed => renamed.map_err(StoreError::io(from)),
        }
    }
}
