//! Recovery: reading the journal after a crash.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use uuid::Uuid;

use super::segment::{self, Break, Frames};
use super::segmented::{SegmentFolder, SegmentedJournal};
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder::FolderPath;
use crate::progress::OpeningProgress;
use mrol_map::map::Change;

/// Result of reading the journal after a snapshot.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Recovered {
    /// Number of changes that were replayed.
    pub replayed: u64,
    /// Bytes of journal that the changes take.
    pub bytes: u64,
    /// The torn end that was cut off: it was never written completely, and so never acknowledged.
    pub cut: Option<Cut>,
    /// Damage that does no harm, since the snapshot holds what was there.
    pub harmless: Option<String>,
}

/// A torn end of the journal that was cut off.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cut {
    /// The segment.
    pub path: PathBuf,
    /// Bytes of the segment that are left.
    pub offset: u64,
    /// Number of bytes that were cut off.
    pub bytes: u64,
    /// What was wrong with the bytes.
    pub reason: String,
}

/// What is known before the journal is read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    /// Revision of the snapshot; later changes are replayed.
    pub(crate) snapshot: u64,
    /// The last revision that is known to have been durable: there is a snapshot of it, readable or not, or a snapshot
    /// names it as the head of the journal.
    pub(crate) durable: u64,
}

impl SegmentedJournal {
    /// Opens the segments in `folder` and calls `replay` with every change after the snapshot, in order.
    ///
    /// A torn end is cut off. What was read is then synced, since a crash may have left it unsynced and it is visible
    /// from now on.
    ///
    /// # Errors
    /// When the system refuses; when a revision is missing or unreadable that may have been acknowledged; when
    /// `replay` fails.
    pub(crate) fn recover(
        files: Arc<dyn FileSystem>,
        folder: &FolderPath,
        map: Uuid,
        known: Known,
        segment_bytes_max: u64,
        progress: &OpeningProgress,
        mut replay: impl FnMut(u64, Change) -> Result<(), String>,
    ) -> Result<(Self, Recovered), StoreError> {
        let path = folder.get();
        let names = files.list(&path).map_err(StoreError::io(&path))?;
        let segments: Vec<u64> = names.iter().filter_map(|name| segment::first_revision(name)).collect();
        let place = SegmentFolder { files, folder: folder.clone(), map };
        let mut journal = Self::at(place, segments, known.snapshot, segment_bytes_max);
        let mut recovered = Recovered::default();
        let needed = journal.segments.partition_point(|&first| first <= known.snapshot + 1);
        let needed = journal.segments[needed.saturating_sub(1)..].to_vec();
        let mut expected = needed.first().map_or(known.snapshot + 1, |&first| first.min(known.snapshot + 1));
        for (i, &first) in needed.iter().enumerate() {
            let path = journal.place.path(first);
            if first != expected && first > known.snapshot + 1 {
                return Err(missing(&path, expected, first));
            }
            let bytes = journal.place.read_until(&path, progress)?;
            progress.read(bytes.len() as u64);
            let mut segment = Segment { path: &path, bytes: &bytes, first, last: i + 1 == needed.len() };
            expected = segment.replay(&journal.place, known, progress, &mut recovered, &mut replay)?;
        }
        journal.head = known.snapshot.max(expected - 1);
        if journal.head < known.durable {
            let (last, acknowledged) = (journal.head, known.durable);
            return Err(StoreError::RevisionsMissing { folder: path, last, acknowledged });
        }
        journal.durable = journal.head;
        Ok((journal, recovered))
    }
}

fn missing(path: &Path, expected: u64, first: u64) -> StoreError {
    StoreError::at(path, 0, expected, format!("it begins with revision {first}, those before it are missing"))
}

/// A segment that is being replayed.
struct Segment<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    first: u64,
    /// True for the last segment.
    last: bool,
}

impl Segment<'_> {
    /// Calls `replay` with the segment's changes after the snapshot; returns the next revision.
    fn replay(
        &mut self,
        place: &SegmentFolder,
        known: Known,
        progress: &OpeningProgress,
        recovered: &mut Recovered,
        replay: &mut impl FnMut(u64, Change) -> Result<(), String>,
    ) -> Result<u64, StoreError> {
        let mut frames = match Frames::of(self.bytes, place.map, self.first) {
            Ok(frames) => frames,
            Err(broken) => return self.ends_with(broken, place, known, recovered),
        };
        loop {
            let at = frames.offset();
            let frame = match frames.next(self.bytes) {
                Ok(Some(frame)) => frame,
                Ok(None) => break,
                Err(broken) => return self.ends_with(broken, place, known, recovered),
            };
            progress.check_wanted()?;
            if frame.revision > known.snapshot {
                let made = frame.change().and_then(|change| replay(frame.revision, change));
                // A segment whose reading was stopped is not damaged.
                progress.check_wanted()?;
                made.map_err(|reason| StoreError::at(self.path, at, frame.revision, reason))?;
                recovered.replayed += 1;
                recovered.bytes += frame.len() as u64;
            }
        }
        if self.last {
            place.files.sync(self.path).map_err(StoreError::io(self.path))?;
        }
        Ok(frames.next_revision())
    }

    /// Handles a segment that breaks off: cuts the end off, or fails; returns the next revision.
    fn ends_with(
        &self,
        broken: Break,
        place: &SegmentFolder,
        known: Known,
        recovered: &mut Recovered,
    ) -> Result<u64, StoreError> {
        let revision = broken.revision;
        if self.last && broken.torn && revision > known.durable {
            recovered.cut = Some(self.cut(broken, place)?);
            Ok(revision)
        } else if self.is_harmless(&broken, known) {
            recovered.harmless = Some(broken.of(self.path, place.map).to_string());
            Ok(known.snapshot + 1)
        } else {
            Err(broken.of(self.path, place.map))
        }
    }

    /// True where the snapshot holds everything that was acknowledged, as far as is known. A segment of another map
    /// shows that the folder is not what it should be.
    fn is_harmless(&self, broken: &Break, known: Known) -> bool {
        let newest = broken.last_behind.unwrap_or(broken.revision).max(broken.revision).max(known.durable);
        self.last && newest <= known.snapshot && broken.foreign.is_none()
    }

    fn cut(&self, broken: Break, place: &SegmentFolder) -> Result<Cut, StoreError> {
        let (offset, bytes) = (broken.offset as u64, self.bytes.len() as u64);
        let cut = || match offset {
            // The segment is begun anew and not removed: otherwise the segment before it would be the last, and other
            // rules would apply to it. Where that fails, as on a full disk, nothing is worse than before: the next
            // record begins it anew.
            0 => place.begin_segment(self.first).map(drop).or(Ok(())),
            _ => place.files.truncate(self.path, offset).and_then(|()| place.files.sync(self.path)),
        };
        cut().map_err(StoreError::io(self.path))?;
        Ok(Cut { path: self.path.to_owned(), offset, bytes: bytes - offset, reason: broken.reason })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file_system::Disk;
    use crate::journal::record::Record;
    use crate::settings::StoreSettings;
    use mrol_map::geometry::Pose;
    use mrol_map::map::{MappedScan, RobotName, ScanRecord};
    use mrol_map::voxel::VoxelSet;

    #[test]
    fn a_replay_that_nobody_wants_any_more_ends_before_the_next_record() {
        let data = tempfile::tempdir().unwrap();
        let files: Arc<dyn FileSystem> = Arc::new(Disk::of_mode(StoreSettings::default().mode));
        let (folder, known) = (FolderPath::new(data.path().to_owned()), Known { snapshot: 0, durable: 0 });
        let progress = OpeningProgress::default();
        let recover = |replay: &mut dyn FnMut(u64, Change) -> Result<(), String>| {
            let files = Arc::clone(&files);
            SegmentedJournal::recover(files, &folder, Uuid::nil(), known, 1 << 20, &progress, replay)
        };
        let (mut journal, _) = recover(&mut |_, _| Ok(())).unwrap();
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        let record =
            Record::of(&Change::Insertion(ScanRecord::of_voxels(pose, VoxelSet::default()))).unwrap();
        journal.append(&[&record; 10]).unwrap();
        journal.sync().unwrap();
        drop(journal);
        let mut replayed = 0;
        let ended = recover(&mut |_, _| {
            replayed += 1;
            if replayed == 3 {
                progress.cancel();
            }
            Ok(())
        });
        assert!(matches!(ended, Err(StoreError::Cancelled)), "it went on to record {replayed}");
        assert_eq!(replayed, 3);
    }
}
