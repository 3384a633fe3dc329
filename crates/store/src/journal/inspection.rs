//! Inspection of a segment, without changing it.

use std::sync::Arc;

use uuid::Uuid;

use super::segment::{Break, Frames};
use super::segmented::SegmentFolder;
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder::FolderPath;
use mrol_map::map::Change;

/// Contents of a segment.
#[derive(Debug)]
pub(crate) struct Inspected {
    /// The revision after the last that can be read.
    pub(crate) next: u64,
    /// Bytes after that, which a crash left and the next start will cut off.
    pub(crate) torn_bytes: u64,
    /// Why the rest cannot be read.
    pub(crate) damage: Option<StoreError>,
}

/// Reads the segment that begins with revision `first`, and calls `each` with its changes; an error of `each` is
/// reported as damage.
///
/// # Errors
/// When the file cannot be read at all.
pub(crate) fn inspect(
    files: &Arc<dyn FileSystem>,
    folder: &FolderPath,
    map: Uuid,
    first: u64,
    mut each: impl FnMut(u64, Change) -> Result<(), String>,
) -> Result<Inspected, StoreError> {
    let place = SegmentFolder { files: Arc::clone(files), folder: folder.clone(), map };
    let path = place.path(first);
    let bytes = place.read(&path)?;
    let mut inspected = Inspected { next: first, torn_bytes: 0, damage: None };
    let mut read = || -> Result<Option<StoreError>, Break> {
        let mut frames = Frames::of(&bytes, map, first)?;
        loop {
            let at = frames.offset();
            let Some(frame) = frames.next(&bytes)? else { return Ok(None) };
            if let Err(reason) = frame.change().and_then(|change| each(frame.revision, change)) {
                return Ok(Some(StoreError::at(&path, at, frame.revision, reason)));
            }
            inspected.next = frames.next_revision();
        }
    };
    match read() {
        Ok(damage) => inspected.damage = damage,
        Err(broken) if broken.torn => inspected.torn_bytes = (bytes.len() - broken.offset) as u64,
        Err(broken) => inspected.damage = Some(broken.of(&path, map)),
    }
    Ok(inspected)
}
