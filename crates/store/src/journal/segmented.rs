//! The journal as files.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use uuid::Uuid;

use super::frame::{self, Frame};
use super::reading::{Changes, StoredRecords};
use super::record::Record;
use super::segment::{self, Frames};
use crate::codec::Unreadable;
use crate::error::StoreError;
use crate::file_system::{Appending, FileSystem};
use crate::folder::{self, FolderPath};
use crate::progress::OpeningProgress;
use mrol_map::map::REVISION_MAX;
use mrol_map::util::{Durations, StopSignal};

/// A journal as segment files in a map's folder. It appends only to segments that it began itself, never to one it
/// found.
#[derive(Debug)]
pub struct SegmentedJournal {
    pub(super) place: SegmentFolder,
    /// The first revisions of the segments, ascending.
    pub(super) segments: Vec<u64>,
    active: Option<Active>,
    pub(super) head: u64,
    /// The last revision that is known to be durable.
    pub(super) durable: u64,
    /// Why the journal accepts nothing more; none while it does.
    stopped: Option<String>,
    segment_bytes_max: u64,
    used: JournalUse,
}

/// Statistics of a journal since it was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct JournalUse {
    /// Number of records appended.
    pub records: u64,
    /// Number of bytes appended, frames included.
    pub bytes: u64,
    /// Number and durations of the syncs.
    pub syncs: Durations,
}

/// Location of a map's segments.
#[derive(Debug, Clone)]
pub(crate) struct SegmentFolder {
    pub(super) files: Arc<dyn FileSystem>,
    pub(super) folder: FolderPath,
    pub(super) map: Uuid,
}

/// The segment that is appended to.
#[derive(Debug)]
struct Active {
    file: Box<dyn Appending>,
    path: PathBuf,
    bytes: u64,
}

impl SegmentedJournal {
    pub(super) fn at(place: SegmentFolder, segments: Vec<u64>, head: u64, segment_bytes_max: u64) -> Self {
        Self {
            place,
            segments,
            active: None,
            head,
            durable: head,
            stopped: None,
            segment_bytes_max,
            used: JournalUse::default(),
        }
    }

    /// Statistics of the journal since it was opened.
    pub fn used(&self) -> JournalUse {
        self.used
    }

    /// Returns the last revision that is known to be durable.
    pub fn durable(&self) -> u64 {
        self.durable
    }

    /// Returns the first revision that can be read; none without a segment.
    pub fn tail(&self) -> Option<u64> {
        self.segments.first().copied()
    }

    /// Returns the first revisions of the segments, ascending.
    pub(crate) fn segments(&self) -> &[u64] {
        &self.segments
    }

    /// Returns the location of the segments.
    pub(crate) fn place(&self) -> &SegmentFolder {
        &self.place
    }

    /// Appends records, which get the revisions after the head, and returns the new head. They are durable after the
    /// next [`Self::sync`], so that one sync serves all waiters.
    ///
    /// # Errors
    /// When they cannot be written. The journal then accepts nothing more.
    pub fn append(&mut self, records: &[&Record]) -> Result<u64, StoreError> {
        // Refused before anything is written, so the journal goes on.
        if records.len() as u64 > REVISION_MAX.saturating_sub(self.head) {
            return Err(StoreError::RevisionsUsedUp(self.head));
        }
        self.or_stop(|journal| journal.write(records))
    }

    /// Makes everything appended so far durable.
    ///
    /// # Errors
    /// When that is not certain. The journal then accepts nothing more and is not synced again: the system may have
    /// dropped what it could not write.
    pub fn sync(&mut self) -> Result<(), StoreError> {
        self.or_stop(Self::sync_active)
    }

    /// Returns the last revision that was appended.
    pub fn head(&self) -> u64 {
        self.head
    }

    /// Reads the changes from `revision` to the present head; a revision that was removed is an error.
    pub fn read_from(&self, revision: u64) -> Changes {
        self.place.read_from(revision, &self.segments, self.head)
    }

    /// Removes changes before `revision`, as far as that is cheap.
    ///
    /// # Errors
    /// When the system refuses; nothing else is removed then.
    pub fn truncate_before(&mut self, revision: u64) -> Result<(), StoreError> {
        // A segment goes when the next one begins early enough.
        while self.segments.get(1).is_some_and(|&next| next <= revision) {
            let path = self.place.path(self.segments[0]);
            self.place.files.remove(&path).map_err(StoreError::io(&path))?;
            self.segments.remove(0);
        }
        let folder = self.place.folder.get();
        self.place.files.sync(&folder).map_err(StoreError::io(&folder))
    }

    /// Ends the present segment. The next record begins another, so that this one can be removed as a whole.
    ///
    /// # Errors
    /// As for [`Self::sync`].
    pub fn end_segment(&mut self) -> Result<(), StoreError> {
        self.sync()?;
        self.active = None;
        Ok(())
    }

    /// Runs `act`; after a failure it is unknown what the disk holds, so the journal accepts nothing more.
    fn or_stop<T>(&mut self, act: impl FnOnce(&mut Self) -> Result<T, StoreError>) -> Result<T, StoreError> {
        if let Some(reason) = &self.stopped {
            return Err(StoreError::JournalStopped(reason.clone()));
        }
        act(self).inspect_err(|error| {
            self.active = None;
            self.stopped = Some(error.to_string());
        })
    }

    fn write(&mut self, records: &[&Record]) -> Result<u64, StoreError> {
        if self.active.as_ref().is_none_or(|active| active.bytes >= self.segment_bytes_max) {
            self.sync_active()?;
            self.active = Some(self.begin_segment()?);
        }
        let mut bytes = Vec::with_capacity(records.iter().map(|record| frame::length_of(record.len())).sum());
        for (revision, record) in (self.head + 1..).zip(records) {
            frame::write(record, revision, self.durable, self.place.map, &mut bytes);
        }
        if let Some(active) = &mut self.active {
            active.file.append(&bytes).map_err(StoreError::io(&active.path))?;
            active.bytes += bytes.len() as u64;
        }
        self.head += records.len() as u64;
        self.used.records += records.len() as u64;
        self.used.bytes += bytes.len() as u64;
        Ok(self.head)
    }

    fn begin_segment(&mut self) -> Result<Active, StoreError> {
        let first = self.head + 1;
        let path = self.place.path(first);
        let file = self.place.begin_segment(first).map_err(StoreError::io(&path))?;
        // A segment without a frame, left by a crash, has the same name.
        if self.segments.last() != Some(&first) {
            self.segments.push(first);
        }
        Ok(Active { file, path, bytes: segment::HEADER_BYTES as u64 })
    }

    fn sync_active(&mut self) -> Result<(), StoreError> {
        if let Some(active) = &mut self.active
            && self.durable < self.head
        {
            let start = Instant::now();
            active.file.sync().map_err(StoreError::io(&active.path))?;
            self.used.syncs.record(start.elapsed());
            self.durable = self.head;
        }
        Ok(())
    }
}

impl SegmentFolder {
    pub(super) fn path(&self, first: u64) -> PathBuf {
        self.folder.file(&segment::file_name(first))
    }

    /// Reads the changes from `revision` to `head` from the segments that begin with the revisions `segments`.
    pub(crate) fn read_from(&self, revision: u64, segments: &[u64], head: u64) -> Changes {
        let first = segments.partition_point(|&first| first <= revision).saturating_sub(1);
        Box::new(self.reader(revision, &segments[first..], head, |frame| frame.change()))
    }

    /// Reads the records from `revision` to `head` from the segments that begin with the revisions `segments`, as they
    /// are.
    pub(crate) fn records_from(&self, revision: u64, segments: &[u64], head: u64) -> StoredRecords {
        let first = segments.partition_point(|&first| first <= revision).saturating_sub(1);
        Box::new(
            self.reader(
                revision,
                segments.get(first..).unwrap_or_default(),
                head,
                |frame| Ok(frame.stored()),
            ),
        )
    }

    /// Reads the records from `revision` to `head` of the segment that begins with revision `first`, as they are.
    pub(crate) fn records_of(&self, revision: u64, first: u64, head: u64) -> StoredRecords {
        Box::new(self.reader(revision, &[first], head, |frame| Ok(frame.stored())))
    }

    fn reader<T>(&self, revision: u64, segments: &[u64], head: u64, read: ReadFrame<T>) -> Reader<T> {
        Reader {
            place: self.clone(),
            segments: segments.iter().copied().collect(),
            revision,
            head,
            open: None,
            read,
        }
    }

    /// Reads only the changes that made `revisions` (ascending); others are skipped without decoding.
    pub(crate) fn read_at(&self, revisions: Vec<u64>, segments: &[u64], head: u64) -> Changes {
        let first = revisions.first().copied().unwrap_or_default();
        let begin = segments.partition_point(|&begins| begins <= first).saturating_sub(1);
        let mut reader = self.reader(first, &segments[begin..], head, |frame| frame.change());
        let known = revisions.into_iter().take_while(move |&revision| revision <= head);
        Box::new(known.map(move |revision| {
            reader.revision = revision;
            reader.read()
        }))
    }

    /// Bytes of the segment that begins with revision `first`.
    pub(crate) fn bytes(&self, first: u64) -> Result<u64, StoreError> {
        let path = self.path(first);
        self.files.size(&path).map_err(StoreError::io(&path))
    }

    /// Creates a segment without a frame, in the place of one that exists.
    pub(super) fn begin_segment(&self, first: u64) -> std::io::Result<Box<dyn Appending>> {
        let mut file = self.files.create(&self.path(first))?;
        file.append(&segment::header(self.map, first))?;
        file.sync()?;
        self.files.sync(&self.folder.get())?;
        Ok(file)
    }

    pub(super) fn read(&self, path: &Path) -> Result<Vec<u8>, StoreError> {
        self.files.read(path).map_err(StoreError::io(path))
    }

    /// Reads a segment, unless `progress` is cancelled.
    pub(super) fn read_until(&self, path: &Path, progress: &OpeningProgress) -> Result<Vec<u8>, StoreError> {
        folder::read_until(&*self.files, path, StopSignal::when(&|| progress.is_cancelled()))
    }
}

/// What is made of a frame.
type ReadFrame<T> = fn(&Frame<'_>) -> Result<T, Unreadable>;

/// Iterator of changes, or of records, read segment by segment.
struct Reader<T> {
    place: SegmentFolder,
    segments: VecDeque<u64>,
    /// The next revision to return.
    revision: u64,
    /// The last revision to return.
    head: u64,
    open: Option<OpenSegment>,
    read: ReadFrame<T>,
}

struct OpenSegment {
    path: PathBuf,
    bytes: Vec<u8>,
    frames: Frames,
}

impl<T> Iterator for Reader<T> {
    type Item = Result<(u64, T), StoreError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.revision > self.head {
            return None;
        }
        let change = self.read();
        match &change {
            Ok(_) => self.revision += 1,
            // Iteration ends after a failure.
            Err(_) => self.revision = u64::MAX,
        }
        Some(change)
    }
}

impl<T> Reader<T> {
    fn read(&mut self) -> Result<(u64, T), StoreError> {
        loop {
            let Some(OpenSegment { path, bytes, frames }) = &mut self.open else {
                self.open = Some(self.next_segment()?);
                continue;
            };
            let at = frames.offset();
            match frames.next(bytes).map_err(|broken| broken.of(path, self.place.map))? {
                Some(frame) if frame.revision == self.revision => {
                    let read = (self.read)(&frame);
                    let read = read.map_err(|reason| StoreError::at(path, at, self.revision, reason))?;
                    return Ok((self.revision, read));
                }
                Some(_) => {}
                None => self.open = None,
            }
        }
    }

    fn next_segment(&mut self) -> Result<OpenSegment, StoreError> {
        let missing = || {
            let reason = format!("revision {} is no longer kept", self.revision);
            StoreError::damaged(&self.place.folder.get(), reason)
        };
        while self.segments.get(1).is_some_and(|&next| next <= self.revision) {
            self.segments.pop_front();
        }
        let first = self.segments.pop_front().filter(|&first| first <= self.revision).ok_or_else(missing)?;
        let path = self.place.path(first);
        let bytes = self.place.read(&path)?;
        let frames =
            Frames::of(&bytes, self.place.map, first).map_err(|broken| broken.of(&path, self.place.map))?;
        Ok(OpenSegment { path, bytes, frames })
    }
}
