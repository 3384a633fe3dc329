//! The check of a map.

use std::path::Path;
use std::sync::Arc;

use super::diagnosis::{AsideFile, Diagnosis};
use super::replay::Replay;
use crate::data_folder::DataDir;
use crate::entry::Entry;
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::snapshots::{self, Snapshot};
use crate::{map_files, viewpoint_parts};
use mrol_map::map::MapName;
use mrol_map::util::StopSignal;

/// Checks a map: reads every snapshot and every record, replays the journal from the oldest snapshot, and compares the
/// map with each snapshot on the way. Changes nothing.
///
/// # Errors
/// When the system refuses. Problems with the files are in the diagnosis.
pub fn diagnose(data_dir: &DataDir, name: &MapName) -> Result<Diagnosis, StoreError> {
    let files = data_dir.files();
    let path = match data_dir.path(name) {
        Ok(path) => path,
        Err(error @ StoreError::TwoFolders { .. }) => return Ok(Diagnosis::of_problem(&error)),
        Err(error) => return Err(error),
    };
    let mut diagnosis = Diagnosis {
        set_aside: aside_files(&**files, &path)?,
        not_understood: map_files::not_understood(&**files, &path)?,
        ..Diagnosis::default()
    };
    let mut snapshots = read_snapshots(&**files, &path, &mut diagnosis)?;
    let Some(oldest) = snapshots.pop() else {
        diagnosis.problems.push(format!("{}: no snapshot can be read", path.display()));
        return Ok(diagnosis);
    };
    let uuid = match Entry::of_path(&path) {
        Entry::Map { uuid, .. } => uuid,
        _ => oldest.uuid,
    };
    let map = oldest.restore().map_err(|e| StoreError::damaged(&path, e.to_string()))?;
    let mut replay = Replay { map, snapshots, problems: Vec::new() };
    replay.read_journal(files, &path, uuid, &mut diagnosis)?;
    // Newer than the journal: nothing to compare them with, but the last of them is what a server would open.
    if let Some(newest) = replay.snapshots.into_iter().next() {
        replay.map = newest.restore().map_err(|e| StoreError::damaged(&path, e.to_string()))?;
    }
    diagnosis.problems.append(&mut replay.problems);
    let revision = replay.map.revision();
    (diagnosis.revision, diagnosis.voxels) = (Some(revision), replay.map.voxels(0));
    diagnosis.viewpoints = replay.map.viewpoints().len();
    if revision < diagnosis.acknowledged && diagnosis.problems.is_empty() {
        let acknowledged = diagnosis.acknowledged;
        let missing = StoreError::RevisionsMissing { folder: path, last: revision, acknowledged };
        diagnosis.problems.push(missing.to_string());
    }
    Ok(diagnosis)
}

/// Checks a map file, which the next start of a server turns into a map: of the first format, or put there by hand.
/// Changes nothing.
///
/// # Errors
/// When the system refuses. Problems with the file are in the diagnosis.
pub fn diagnose_file(data_dir: &DataDir, name: &MapName) -> Result<Diagnosis, StoreError> {
    let snapshot = match data_dir.read_file(name, StopSignal::NEVER) {
        Ok((_, snapshot)) => snapshot,
        Err(error @ StoreError::Io { .. }) => return Err(error),
        Err(error) => return Ok(Diagnosis::of_problem(&error)),
    };
    let revision = snapshot.contents.revision;
    let mut diagnosis =
        Diagnosis { snapshots: vec![revision], revision: Some(revision), ..Diagnosis::default() };
    match snapshot.restore() {
        Ok(map) => (diagnosis.voxels, diagnosis.viewpoints) = (map.voxels(0), map.viewpoints().len()),
        Err(error) => diagnosis.problems.push(error.to_string()),
    }
    Ok(diagnosis)
}

fn aside_files(files: &dyn FileSystem, path: &Path) -> Result<Vec<AsideFile>, StoreError> {
    let file = |name: String| {
        let bytes = files.size(&path.join(&name)).map_err(StoreError::io(path.join(&name)))?;
        Ok(AsideFile { name, bytes })
    };
    map_files::set_aside_in(files, path)?.into_iter().map(file).collect()
}

/// The snapshots that can be read, newest first.
pub(super) fn read_snapshots(
    files: &dyn FileSystem,
    path: &Path,
    diagnosis: &mut Diagnosis,
) -> Result<Vec<Snapshot>, StoreError> {
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let expected = match Entry::of_path(path) {
        Entry::Map { uuid, .. } => Some(uuid),
        _ => None,
    };
    for revision in map_files::snapshot_revisions(files, path)?.into_iter().rev() {
        let file = path.join(map_files::snapshot_name(revision));
        let bytes = files.read(&file).map_err(StoreError::io(&file))?;
        let decoded = Snapshot::decode_own(&bytes, StopSignal::NEVER)?;
        match decoded.map_err(|reason| StoreError::damaged(&file, reason)) {
            Ok((snapshot, _)) if snapshot.contents.revision != revision => {
                let found = snapshot.contents.revision;
                diagnosis.problems.push(format!("{}: it holds revision {found}", file.display()));
            }
            Ok((snapshot, _))
                if expected
                    .or(snapshots.first().map(|newest| newest.uuid))
                    .is_some_and(|it| it != snapshot.uuid) =>
            {
                diagnosis.problems.push(format!("{}: another map's, by its uuid", file.display()));
            }
            Ok((mut snapshot, parts)) => {
                if !parts.is_empty() {
                    let note = |error: StoreError| diagnosis.problems.push(error.to_string());
                    let viewpoints = viewpoint_parts::load_readable(files, path, snapshot.uuid, &parts, note);
                    snapshot.contents.viewpoints = Arc::new(viewpoints);
                }
                let head = snapshots::head_of(&bytes).unwrap_or_default().max(revision);
                diagnosis.acknowledged = diagnosis.acknowledged.max(head);
                snapshots.push(snapshot);
            }
            Err(error @ StoreError::Damaged { .. }) => diagnosis.problems.push(error.to_string()),
            Err(error) => return Err(error),
        }
    }
    diagnosis.snapshots = snapshots.iter().rev().map(|snapshot| snapshot.contents.revision).collect();
    Ok(snapshots)
}
