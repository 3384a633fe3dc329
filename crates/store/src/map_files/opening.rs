//! Creating and opening a map's folder.

use std::path::PathBuf;
use std::sync::Arc;

use uuid::Uuid;

use super::map_folder::{Found, MapFolder};
use super::snapshot_files::{
    Newest, check_owner, newest_good, not_understood, set_aside, snapshot_name, snapshot_revisions,
};
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder::{self, FolderPath};
use crate::journal::{Known, Recovered, SegmentedJournal};
use crate::progress::OpeningProgress;
use crate::settings::StoreSettings;
use crate::snapshots::Snapshot;
use crate::viewpoint_parts::{self, ViewpointParts};
use mrol_map::map::{Change, ContentHistory, KEEP_OUTS_MAX, KeepOutRecord, MultiResolutionMap};
use mrol_map::util::StopSignal;

/// A map that was opened.
#[derive(Debug)]
pub struct OpenedMap {
    /// Folder of the map.
    pub folder: MapFolder,
    /// The uuid of this incarnation of the map.
    pub uuid: Uuid,
    /// The map at the revision of the last durable change.
    pub map: MultiResolutionMap,
    /// The hashes of the snapshot's revision and of those after it.
    pub history: ContentHistory,
    /// Revision of the snapshot that it was read from.
    pub snapshot: u64,
    /// Result of reading the journal after the snapshot.
    pub recovered: Recovered,
    /// Newer snapshots that could not be read and were set aside.
    pub damaged: Vec<String>,
    /// Parts of the viewpoints that could not be read; their copies were.
    pub damaged_parts: Vec<String>,
    /// Files in the folder that are not part of a map.
    pub not_understood: Vec<String>,
}

impl MapFolder {
    /// The folder of a map whose only snapshot was just written.
    pub(crate) fn new(
        files: Arc<dyn FileSystem>,
        path: PathBuf,
        settings: StoreSettings,
        first: &Snapshot,
    ) -> Result<Self, StoreError> {
        let (revision, path) = (first.contents.revision, FolderPath::new(path));
        let known = Known { snapshot: revision, durable: revision };
        let progress = OpeningProgress::default();
        let (journal, _) = SegmentedJournal::recover(
            Arc::clone(&files),
            &path,
            first.uuid,
            known,
            settings.segment_bytes_max,
            &progress,
            |_, _| Ok(()),
        )?;
        let found = Found { snapshots: vec![revision], parts: ViewpointParts::default(), journal_bytes: 0 };
        Ok(Self::with(files, first.uuid, path, settings, journal, found))
    }

    /// Opens the folder of the map `uuid`: the newest good snapshot, and every change of the journal after it.
    ///
    /// # Errors
    /// When the system refuses, no snapshot is good, a file is another map's, or the journal misses something that may
    /// have been acknowledged: the error names file, offset and what helps.
    pub(crate) fn open(
        files: Arc<dyn FileSystem>,
        path: PathBuf,
        uuid: Uuid,
        settings: StoreSettings,
        progress: &OpeningProgress,
    ) -> Result<OpenedMap, StoreError> {
        progress.check_wanted()?;
        folder::sweep(&*files, &path)?;
        let mut revisions = snapshot_revisions(&*files, &path)?;
        let last_written = revisions.last().copied().unwrap_or_default();
        let Newest { snapshot, head, parts, damaged } =
            newest_good(&*files, &path, &mut revisions, progress)?;
        let revision = snapshot.contents.revision;
        if snapshot.uuid != uuid {
            let path = path.join(snapshot_name(revision));
            return Err(StoreError::Foreign { path, found: snapshot.uuid, expected: uuid });
        }
        let read: Vec<u64> = damaged.iter().map(|(revision, _)| *revision).chain([revision]).collect();
        check_owner(&*files, &path, uuid, &read, progress)?;
        let is_cancelled = || progress.is_cancelled();
        let stop = StopSignal::when(&is_cancelled);
        let map = MultiResolutionMap::restore_until(snapshot.settings, snapshot.contents, stop)
            .map_err(|e| StoreError::damaged(&path, e.to_string()))?
            .ok_or(StoreError::Cancelled)?;
        let mut history = ContentHistory::of(map.content_version(), map.state_hash());
        let replay = |revision, change| {
            check_replayed(&map, &change)?;
            let committed = map.committer().apply_until(&change, stop).ok_or("it was stopped")?;
            let made = format!("replayed, it makes revision {}", committed.revision);
            history.push(committed.version(), map.state_hash());
            (committed.revision == revision).then_some(()).ok_or(made)
        };
        let known = Known { snapshot: revision, durable: last_written.max(head) };
        let at = FolderPath::new(path.clone());
        let segment_bytes_max = settings.segment_bytes_max;
        let (journal, recovered) = SegmentedJournal::recover(
            Arc::clone(&files),
            &at,
            uuid,
            known,
            segment_bytes_max,
            progress,
            replay,
        )?;
        set_aside(&*files, &path, &damaged)?;
        let not_understood = not_understood(&*files, &path)?;
        let damaged = damaged.into_iter().map(|(_, error)| error.to_string()).collect();
        let last_part = viewpoint_parts::numbers_in(&*files, &path)?.last().copied().unwrap_or_default();
        let damaged_parts = parts.damaged.iter().map(ToString::to_string).collect();
        let parts = ViewpointParts::new(parts.known, last_part);
        let found = Found { snapshots: revisions, parts, journal_bytes: recovered.bytes };
        let folder = Self::with(files, uuid, at, settings, journal, found);
        Ok(OpenedMap {
            folder,
            uuid,
            map,
            history,
            snapshot: revision,
            recovered,
            damaged,
            damaged_parts,
            not_understood,
        })
    }
}

/// Checks a change that is about to be made again: what a snapshot may not hold, no change may bring in.
///
/// # Errors
/// Says what the map may not hold.
pub fn check_replayed(map: &MultiResolutionMap, change: &Change) -> Result<(), String> {
    match change {
        Change::Insertion(scan) => scan.pose.check_levels(map.settings().levels).map_err(|e| e.to_string()),
        Change::KeepOut(KeepOutRecord { change, .. }) => {
            map.keep_outs().check_room_for(&change.name, KEEP_OUTS_MAX).map_err(|e| e.to_string())
        }
        Change::Deletion(_) | Change::Undo(_) => Ok(()),
    }
}
