//! A damaged map is set aside, and what can be read of it becomes a map.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use uuid::Uuid;

use super::diagnose::read_snapshots;
use super::diagnosis::Diagnosis;
use super::replay::Replay;
use crate::data_folder::{DataDir, DataDirContents};
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::progress::OpeningProgress;
use crate::snapshots::Snapshot;
use mrol_map::map::{MapName, MultiResolutionMap};
use mrol_map::util::StopSignal;

/// Result of [`set_aside`].
#[derive(Debug)]
pub struct SetAside {
    /// Where the damaged folder lies now.
    pub folder: PathBuf,
    /// Revision of the map that was made of what can be read.
    pub revision: u64,
    /// Keep-outs that this map has.
    pub keep_outs: usize,
    /// Viewpoints that this map has.
    pub viewpoints: usize,
}

/// Makes a map of what can be read of one that cannot be opened, and sets the folder of that aside as it is. None where
/// the map can be opened.
///
/// The map begins anew, with a uuid of its own: its history goes on otherwise than that which clients may have seen.
///
/// # Errors
/// When the system refuses, or there is no snapshot that can be read.
pub fn set_aside(data_dir: &DataDir, name: &MapName) -> Result<Option<SetAside>, StoreError> {
    use StoreError::{Damaged, Foreign, JournalDamaged, RevisionsMissing};
    // An exchange that a crash interrupted may be that of an earlier call.
    data_dir.end_replacements(&mut DataDirContents::default())?;
    let refusal = match data_dir.map(name, &OpeningProgress::default()) {
        Ok(_) => return Ok(None),
        Err(error @ (Damaged { .. } | JournalDamaged { .. } | Foreign { .. } | RevisionsMissing { .. })) => {
            error
        }
        Err(error) => return Err(error),
    };
    let path = data_dir.path(name)?;
    let map = match readable(data_dir.files(), &path) {
        // It says which file is at fault.
        Err(Damaged { .. }) => return Err(refusal),
        map => map?,
    };
    let first = Snapshot::of(&map, Uuid::new_v4());
    let folder = data_dir.replace_damaged(name, &path, &first)?;
    let (revision, keep_outs) = (first.contents.revision, first.contents.keep_outs.len());
    let viewpoints = first.contents.viewpoints.len();
    Ok(Some(SetAside { folder, revision, keep_outs, viewpoints }))
}

/// Sets a map file aside that no server takes in, of the first format for example: it is renamed, as it is. Nothing of
/// a damaged one can be read, so that no map is made. None where there is no such file, or it can be taken in.
///
/// # Errors
/// When the system refuses.
pub fn set_file_aside(data_dir: &DataDir, name: &MapName) -> Result<Option<PathBuf>, StoreError> {
    if !data_dir.file_names()?.contains(name) {
        return Ok(None);
    }
    match data_dir.read_file(name, StopSignal::NEVER) {
        Ok(_) => Ok(None),
        Err(error @ StoreError::Io { .. }) => Err(error),
        Err(_) => data_dir.set_file_aside(name).map(Some),
    }
}

/// The map that a folder still gives: that of the newest snapshot, and the changes after it up to what cannot be read.
fn readable(files: &Arc<dyn FileSystem>, path: &Path) -> Result<MultiResolutionMap, StoreError> {
    let mut found = Diagnosis::default();
    let newest = read_snapshots(&**files, path, &mut found)?.into_iter().next();
    let newest = newest.ok_or_else(|| StoreError::damaged(path, "no snapshot can be read"))?;
    let uuid = newest.uuid;
    let map = newest.restore().map_err(|e| StoreError::damaged(path, e.to_string()))?;
    let mut replay = Replay { map, snapshots: Vec::new(), problems: Vec::new() };
    replay.read_journal(files, path, uuid, &mut found)?;
    Ok(replay.map)
}
