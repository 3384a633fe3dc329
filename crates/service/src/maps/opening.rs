//! The maps of a data folder at a start: those that can be opened, and why the others cannot; how many are opened at
//! once, and how many requests may wait for that.

use std::sync::Arc;
use std::time::Instant;

use super::asleep::Asleep;
use super::named::Named;
use super::snapshots::thin;
use crate::error::{Reason, ServiceError};
use crate::work::Shares;
use mrol_map::map::MapName;
use mrol_store::{Cut, DataDir, OpenedMap, OpeningProgress, StoreError};

/// Of `requests_max`, the share that may wait for maps that are opened: the rest is left for other maps. One caller may
/// have half of that wait, a quarter for one map; half is as many as it may have in work by default.
const WAITING_SHARE: [usize; 2] = [3, 4];

/// Finds the maps of a data folder; none of them is open yet.
pub(super) fn find_all(data_dir: &DataDir, progress: &OpeningProgress) -> Result<Named, ServiceError> {
    let contents = data_dir.import_map_files_until(progress).map_err(not_stored)?;
    for path in contents.not_understood {
        tracing::warn!(path = %path.display(), "not understood, and left alone: no map");
    }
    let folders = data_dir.folders().map_err(not_stored)?;
    data_dir.expect(&folders, progress);
    if let Some(error) = &contents.not_swept {
        tracing::warn!(%error, "what a crash left unfinished cannot be swept away: the next start tries again");
    }
    let mut maps = Named::default();
    for (name, folders) in folders {
        maps.asleep.insert(name, Arc::new(Asleep::not_opened(folders)));
    }
    for (name, error) in contents.refused {
        // The map that is there is served; the rest waits for somebody, or for the next start.
        if maps.asleep.contains_key(&name) {
            tracing::error!(map = %name, %error, "what the data folder has for this map is not put right");
        } else {
            maps.set_unavailable(name, &error);
        }
    }
    Ok(maps)
}

/// Maps that are opened at once, or saved at the end: it is work for the CPU, and waits for the disk between.
pub(crate) fn maps_at_once() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from).max(2)
}

/// The places of requests that wait for maps that are opened, where so many are in work at once.
pub(super) fn waiting_within(requests_max: usize) -> Arc<Shares> {
    let [part, whole] = WAITING_SHARE;
    Arc::new(Shares::new((requests_max.saturating_mul(part) / whole).max(1)))
}

/// Opens one map, and says what was found of it; `folders` are those that claim to be it, where they were listed
/// before.
pub(super) fn open_one(
    data_dir: &DataDir,
    name: &MapName,
    folders: Option<&[String]>,
    progress: &OpeningProgress,
) -> Result<OpenedMap, StoreError> {
    tracing::debug!(map = %name, "opening");
    let start = Instant::now();
    let opened = match folders {
        Some(folders) => data_dir.map_of(name, folders, progress)?,
        None => data_dir.map(name, progress)?,
    };
    report(name, &opened, start);
    // The snapshot was written before what went when it was there.
    thin(&opened.map, &opened.folder);
    Ok(opened)
}

/// Says what was found of a map.
fn report(name: &MapName, opened: &OpenedMap, start: Instant) {
    for damaged in &opened.damaged {
        tracing::warn!(map = %name, %damaged, "a snapshot is damaged: set aside, an older one and more journal are used");
    }
    for damaged in &opened.damaged_parts {
        tracing::warn!(map = %name, %damaged, "a part of the viewpoints is damaged: its copy is used, the next snapshot writes it again");
    }
    for file in &opened.not_understood {
        tracing::warn!(map = %name, file, "a file in the map's folder is not understood, and left alone");
    }
    if let Some(Cut { path, offset, bytes, reason }) = &opened.recovered.cut {
        let file = path.display();
        tracing::warn!(map = %name, %file, offset, bytes, reason, "cut off an end that was never acknowledged");
    }
    if let Some(harmless) = &opened.recovered.harmless {
        tracing::warn!(map = %name, harmless, "the journal is damaged where the snapshot holds what was there");
    }
    let (revision, replayed, snapshot) = (opened.map.revision(), opened.recovered.replayed, opened.snapshot);
    let (voxels, elapsed) = (opened.map.voxels(0), start.elapsed());
    tracing::info!(map = %name, revision, snapshot, replayed, voxels, ?elapsed, "opened");
}

/// The disk refused it.
pub(super) fn not_stored(error: StoreError) -> ServiceError {
    ServiceError::new(Reason::NotStored, error.to_string())
}
