//! The maps of a data folder at a start: those that can be opened, and why the others cannot.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use parking_lot::Mutex;

use super::hosted_map::HostedMap;
use super::named::Named;
use super::snapshots::thin;
use crate::commit::CommitThreads;
use crate::error::{Reason, ServiceError};
use mrol_map::map::MapName;
use mrol_store::{Cut, DataDir, OpenedMap, OpeningProgress, StoreError, StoreSettings};

/// Opens what can be opened, side by side: as many at once as there are cores.
pub(super) fn open_all(
    data_dir: &DataDir,
    threads: &Arc<CommitThreads>,
    settings: &StoreSettings,
    progress: &OpeningProgress,
) -> Result<Named, ServiceError> {
    let contents = data_dir.import_map_files_until(progress).map_err(not_stored)?;
    for path in contents.not_understood {
        tracing::warn!(path = %path.display(), "not understood, and left alone: no map");
    }
    let folders = data_dir.folders().map_err(not_stored)?;
    data_dir.expect(&folders, progress);
    if let Some(error) = &contents.not_swept {
        tracing::warn!(%error, "what a crash left unfinished cannot be swept away: the next start tries again");
    }
    let open = |name: &MapName, folders: &[String]| {
        open_one(data_dir, name, folders, progress)
            .map(|opened| HostedMap::opened(threads, name.clone(), opened, settings))
    };
    let mut maps = side_by_side(folders, open).map_err(not_stored)?;
    for (name, error) in contents.refused {
        // The map that is there is served; the rest waits for somebody, or for the next start.
        if maps.open.contains_key(&name) || maps.unavailable.contains_key(&name) {
            tracing::error!(map = %name, %error, "what the data folder has for this map is not put right");
        } else {
            maps.set_unavailable(name, &error);
        }
    }
    Ok(maps)
}

/// Opens each of the maps by `open`, on as many threads as there are cores; one that fails keeps no other back.
///
/// # Errors
/// `Cancelled` once the opening was cancelled.
fn side_by_side(
    folders: BTreeMap<MapName, Vec<String>>,
    open: impl Fn(&MapName, &[String]) -> Result<HostedMap, StoreError> + Sync,
) -> Result<Named, StoreError> {
    let count = std::thread::available_parallelism().map_or(1, usize::from).min(folders.len());
    let (maps, rest) = (Mutex::new(Named::default()), Mutex::new(folders.into_iter()));
    let work = || {
        loop {
            let next = rest.lock().next();
            let Some((name, folders)) = next else { return Ok(()) };
            match open(&name, &folders) {
                Ok(map) => drop(maps.lock().open.insert(name, Arc::new(map))),
                Err(error @ StoreError::Cancelled) => return Err(error),
                Err(error) => maps.lock().set_unavailable(name, &error),
            }
        }
    };
    std::thread::scope(|scope| {
        let spawn = |number: usize| {
            let thread = std::thread::Builder::new().name(format!("mrol-opening-{number}"));
            // Where the system has no thread left, those that are there do it.
            thread.spawn_scoped(scope, work).ok()
        };
        let others: Vec<_> = (1..count).filter_map(spawn).collect();
        let own = work();
        let joined = others.into_iter().map(|other| match other.join() {
            Ok(ended) => ended,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        joined.fold(own, Result::and)
    })?;
    Ok(maps.into_inner())
}

/// Opens one map, and says what was found of it.
fn open_one(
    data_dir: &DataDir,
    name: &MapName,
    folders: &[String],
    progress: &OpeningProgress,
) -> Result<OpenedMap, StoreError> {
    tracing::info!(map = %name, "opening");
    let start = Instant::now();
    let opened = data_dir.map_of(name, folders, progress)?;
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
