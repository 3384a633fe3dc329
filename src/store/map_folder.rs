//! The folder of one map: snapshots, and the journal that goes on from them.
//!
//! ```text
//! office/snapshot-00000000000000000000.mrol      at that revision
//! office/snapshot-00000000000000004711.mrol
//! office/journal-00000000000000000001.log        from that revision on
//! office/journal-00000000000000004712.log
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use uuid::Uuid;

use super::journal::{Journal, JournalUse, Known, Record, Recovered, SegmentedJournal};
use super::snapshot_files::{forget_damaged, newest_good, set_aside, snapshot_name, snapshot_revisions};
use super::{FileSystem, OpeningProgress, Snapshot, StoreError, StoreSettings, folder, retention};
use crate::map::{MultiResolutionMap, Observations, WithdrawnScan};
use crate::util::StopSignal;

/// What keeps a map across crashes.
#[derive(Debug)]
pub struct MapFolder {
    files: Arc<dyn FileSystem>,
    path: PathBuf,
    settings: StoreSettings,
    journal: Mutex<SegmentedJournal>,
    /// Revisions of those on disk, ascending; held while one is written.
    snapshots: Mutex<Vec<u64>>,
    saved: Mutex<Saved>,
}

/// How long after one that could not be written the next snapshot is due at the earliest: to make one takes a while of
/// a thread, and a disk that is full does not empty at once.
const AGAIN_AFTER: Duration = Duration::from_secs(5);

/// How much journal there is behind the newest snapshot, and since when.
#[derive(Debug, Clone, Copy)]
struct Saved {
    at: Instant,
    /// Bytes of journal that were found behind it at the start.
    found: u64,
    /// Bytes that had been appended when it was written.
    appended: u64,
    /// When the next one could not be written.
    failed: Option<Instant>,
}

/// A map as it was found.
#[derive(Debug)]
pub struct OpenedMap {
    /// Where it is kept.
    pub folder: MapFolder,
    /// Of this incarnation of the map.
    pub uuid: Uuid,
    /// At the revision of the last durable change.
    pub map: MultiResolutionMap,
    /// The snapshot it was read from.
    pub snapshot: u64,
    /// What was found behind it.
    pub recovered: Recovered,
    /// Newer snapshots that could not be read, and were set aside.
    pub damaged: Vec<String>,
}

/// How much is kept of a map, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FolderUse {
    /// The last revision that is known to be durable.
    pub durable: u64,
    /// The newest snapshot's revision.
    pub snapshot: u64,
    /// Scans of this revision and later can be undone.
    pub undo_from: u64,
    /// What the journal has done.
    pub journal: JournalUse,
}

impl MapFolder {
    /// Makes a map's folder with its first snapshot; it is there as a whole or not at all.
    pub(super) fn create(
        files: &Arc<dyn FileSystem>,
        path: &Path,
        first: &Snapshot,
    ) -> Result<(), StoreError> {
        let aside = folder::unfinished(path);
        files.create_folder(&aside).map_err(StoreError::io(&aside))?;
        first.write(&**files, &aside.join(snapshot_name(first.contents.revision)))?;
        let above = folder::folder_of(path);
        files.rename(&aside, path).and_then(|()| files.sync(above)).map_err(StoreError::io(path))
    }

    /// A folder whose one snapshot was just written.
    pub(super) fn new(
        files: Arc<dyn FileSystem>,
        path: PathBuf,
        settings: StoreSettings,
        first: &Snapshot,
    ) -> Result<Self, StoreError> {
        let revision = first.contents.revision;
        let known = Known { snapshot: revision, durable: revision };
        let segment_bytes_max = settings.segment_bytes_max;
        let nothing = |_, _| Ok(());
        let (journal, _) = SegmentedJournal::recover(
            Arc::clone(&files),
            &path,
            first.uuid,
            known,
            segment_bytes_max,
            &OpeningProgress::default(),
            nothing,
        )?;
        Ok(Self::with(files, path, settings, journal, vec![revision], 0))
    }

    /// Opens a map: the newest good snapshot, and every change of the journal after it.
    ///
    /// # Errors
    /// When the system refuses, no snapshot is good, or the journal misses something that may have been
    /// acknowledged: the error names file, offset and what helps.
    pub(super) fn open(
        files: Arc<dyn FileSystem>,
        path: PathBuf,
        settings: StoreSettings,
        progress: &OpeningProgress,
    ) -> Result<OpenedMap, StoreError> {
        folder::sweep(&*files, &path)?;
        let mut revisions = snapshot_revisions(&*files, &path)?;
        let durable = revisions.last().copied().unwrap_or_default();
        let (snapshot, damaged) = newest_good(&*files, &path, &mut revisions, progress)?;
        let (uuid, revision) = (snapshot.uuid, snapshot.contents.revision);
        let map_settings = snapshot.settings;
        let map = MultiResolutionMap::restore(map_settings, snapshot.contents)
            .map_err(|e| StoreError::damaged(&path, e.to_string()))?;
        let replay = |revision, change| {
            let committed = map.committer().apply(&change);
            let made = format!("replayed, it makes revision {}", committed.revision);
            (committed.revision == revision).then_some(()).ok_or(made)
        };
        let known = Known { snapshot: revision, durable };
        let (journal, recovered) = SegmentedJournal::recover(
            Arc::clone(&files),
            &path,
            uuid,
            known,
            settings.segment_bytes_max,
            progress,
            replay,
        )?;
        set_aside(&*files, &path, &damaged)?;
        let folder = Self::with(files, path, settings, journal, revisions, recovered.bytes);
        let damaged = damaged.into_iter().map(|(_, error)| error.to_string()).collect();
        Ok(OpenedMap { folder, uuid, map, snapshot: revision, recovered, damaged })
    }

    fn with(
        files: Arc<dyn FileSystem>,
        path: PathBuf,
        settings: StoreSettings,
        journal: SegmentedJournal,
        snapshots: Vec<u64>,
        found: u64,
    ) -> Self {
        let (journal, snapshots) = (Mutex::new(journal), Mutex::new(snapshots));
        let saved = Mutex::new(Saved { at: Instant::now(), found, appended: 0, failed: None });
        Self { files, path, settings, journal, snapshots, saved }
    }

    /// Appends records; see [`Journal::append`].
    ///
    /// # Errors
    /// As there.
    pub fn append(&self, records: &[&Record]) -> Result<u64, StoreError> {
        self.journal.lock().append(records)
    }

    /// Makes all that was appended durable; see [`Journal::sync`].
    ///
    /// # Errors
    /// As there.
    pub fn sync(&self) -> Result<(), StoreError> {
        self.journal.lock().sync()
    }

    /// How the map is kept.
    pub fn settings(&self) -> &StoreSettings {
        &self.settings
    }

    /// Writes a snapshot of at most `bytes_max` beside the others, and forgets snapshots and journal that nobody needs any
    /// more. Where it cannot, a while passes before the next one is due.
    ///
    /// # Errors
    /// `NoRoom` for a larger one; when the system refuses, or the journal stopped. What was there is then there still.
    pub fn save(&self, snapshot: &Snapshot, bytes_max: u64) -> Result<(), StoreError> {
        self.write(snapshot, bytes_max).inspect_err(|_| self.saved.lock().failed = Some(Instant::now()))
    }

    fn write(&self, snapshot: &Snapshot, bytes_max: u64) -> Result<(), StoreError> {
        let mut snapshots = self.snapshots.lock();
        let revision = snapshot.contents.revision;
        let path = self.path.join(snapshot_name(revision));
        let file = snapshot.encode().map_err(StoreError::io(&path))?;
        if file.len() as u64 > bytes_max {
            return Err(StoreError::NoRoom { bytes: file.len() as u64, bytes_max });
        }
        // What the snapshot holds is durable in the journal before; what comes next begins a segment.
        self.journal.lock().end_segment()?;
        folder::replace(&*self.files, &path, &file)?;
        if snapshots.last() != Some(&revision) {
            snapshots.push(revision);
        }
        let appended = self.journal.lock().used().bytes;
        *self.saved.lock() = Saved { at: Instant::now(), found: 0, appended, failed: None };
        self.forget(&mut snapshots, snapshot.contents.trajectory.withdrawn())
    }

    /// True when there is much journal since the last snapshot, or that is old; not just after one that failed.
    pub fn snapshot_is_due(&self) -> bool {
        let Saved { at, found, appended, failed } = *self.saved.lock();
        if failed.is_some_and(|failed| failed.elapsed() < AGAIN_AFTER) {
            return false;
        }
        let bytes = found + self.journal.lock().used().bytes - appended;
        bytes >= self.settings.snapshot_journal_bytes || at.elapsed() >= self.settings.snapshot_interval
    }

    fn forget(&self, snapshots: &mut Vec<u64>, withdrawn: &[WithdrawnScan]) -> Result<(), StoreError> {
        let head = snapshots.last().copied().unwrap_or_default();
        let kept = retention::kept(snapshots, head, self.settings.undo_revisions, withdrawn);
        // The journal first: a snapshot without the journal behind it would be a gap, one more is not.
        if let Some(base) = kept.first() {
            self.journal.lock().truncate_before(base + 1)?;
            forget_damaged(&*self.files, &self.path, *base)?;
        }
        for &revision in snapshots.iter().filter(|revision| !kept.contains(revision)) {
            let path = self.path.join(snapshot_name(revision));
            self.files.remove(&path).map_err(StoreError::io(&path))?;
        }
        *snapshots = kept;
        self.files.sync(&self.path).map_err(StoreError::io(&self.path))
    }

    /// Who holds which voxels, up to the present head of the journal, and that head; none where the journal does
    /// not reach back to the first of `scans`, and where it is stopped.
    ///
    /// # Errors
    /// When a snapshot or the journal cannot be read.
    pub fn observations(
        &self,
        scans: &[u64],
        withdrawn: &[WithdrawnScan],
        stop: StopSignal<'_>,
    ) -> Result<Option<(Observations, u64)>, StoreError> {
        let Some(base) = self.base_of(scans, withdrawn) else {
            return Ok(None);
        };
        let path = self.path.join(snapshot_name(base));
        let base_contents = Snapshot::read(&*self.files, &path)?.contents;
        let Some(mut observations) = Observations::new(scans.to_vec(), withdrawn, &base_contents, stop)
        else {
            return Ok(None);
        };
        let head = self.observe(&mut observations, base, stop)?;
        Ok(Some((observations, head)))
    }

    /// Shows `observations` the changes after revision `seen`, while somebody wants to know; the head of the journal.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn observe(
        &self,
        observations: &mut Observations,
        seen: u64,
        stop: StopSignal<'_>,
    ) -> Result<u64, StoreError> {
        let (changes, head) = {
            let journal = self.journal.lock();
            (journal.read_from(seen + 1), journal.head())
        };
        for change in changes.take_while(|_| !stop.is_stopped()) {
            let (revision, change) = change?;
            observations.observe(revision, &change);
        }
        Ok(head)
    }

    /// The newest snapshot that undo can begin with.
    fn base_of(&self, scans: &[u64], withdrawn: &[WithdrawnScan]) -> Option<u64> {
        let first = *scans.iter().min()?;
        let snapshots = self.snapshots.lock();
        let tail = self.journal.lock().tail()?;
        let fits = |&&snapshot: &&u64| {
            snapshot < first && tail <= snapshot + 1 && retention::is_base(snapshot, withdrawn)
        };
        snapshots.iter().rfind(fits).copied()
    }

    /// How much is kept, and how.
    pub fn used(&self) -> FolderUse {
        let (oldest, newest) = {
            let snapshots = self.snapshots.lock();
            (snapshots.first().copied().unwrap_or_default(), snapshots.last().copied().unwrap_or_default())
        };
        let journal = self.journal.lock();
        let undo_from = journal.tail().map_or(journal.head() + 1, |tail| tail.max(oldest + 1));
        FolderUse { durable: journal.durable(), snapshot: newest, undo_from, journal: journal.used() }
    }
}
