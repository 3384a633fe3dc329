//! The maps of a data folder at a start: those that can be opened, and why the others cannot.

use std::sync::Arc;
use std::time::Instant;

use super::hosted_map::HostedMap;
use super::named::Named;
use super::snapshots::thin;
use crate::commit::CommitThread;
use crate::error::{Reason, ServiceError};
use mrol_map::map::MapName;
use mrol_store::{Cut, DataDir, OpenedMap, OpeningProgress, StoreError, StoreSettings};

/// Opens what can be opened.
pub(super) fn open_all(
    data_dir: &DataDir,
    settings: &StoreSettings,
    progress: &OpeningProgress,
) -> Result<Named, ServiceError> {
    let contents = data_dir.import_map_files_until(progress).map_err(not_stored)?;
    for path in contents.not_understood {
        tracing::warn!(path = %path.display(), "not understood, and left alone: no map");
    }
    data_dir.expect(&contents.maps, progress);
    if let Some(error) = &contents.not_swept {
        tracing::warn!(%error, "what a crash left unfinished cannot be swept away: the next start tries again");
    }
    let mut maps = Named::default();
    for name in contents.maps {
        tracing::info!(map = %name, "opening");
        let start = Instant::now();
        match data_dir.map(&name, progress) {
            Ok(opened) => {
                report(&name, &opened, start);
                // The snapshot was written before what went when it was there.
                thin(&opened.map, &opened.folder);
                let thread = CommitThread::start(&name)?;
                let map = HostedMap::opened(thread, name.clone(), opened, settings);
                maps.open.insert(name, Arc::new(map));
            }
            Err(error @ StoreError::Cancelled) => return Err(not_stored(error)),
            Err(error) => maps.set_unavailable(name, &error),
        }
    }
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
