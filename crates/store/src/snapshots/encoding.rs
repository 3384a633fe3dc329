//! A snapshot as the bytes of a map file, and written to one.

use std::path::Path;

use super::header::{begun, set_checksum};
use super::snapshot::Snapshot;
use super::writing::body_of;
use crate::compression::compress_onto;
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder;
use mrol_map::util::StopSignal;
use mrol_map::visibility::ViewpointSet;

impl Snapshot {
    /// Writes the snapshot to `path` atomically: to a file beside it, which is then renamed.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&self, files: &dyn FileSystem, path: &Path) -> Result<(), StoreError> {
        self.write_until(files, path, StopSignal::NEVER)
    }

    /// [`Snapshot::write`] under a stop signal; once stopped, nothing is on the disk.
    ///
    /// # Errors
    /// As for [`Snapshot::write`]; `Cancelled` once stopped.
    pub(crate) fn write_until(
        &self,
        files: &dyn FileSystem,
        path: &Path,
        stop: StopSignal<'_>,
    ) -> Result<(), StoreError> {
        let bytes = self.encode_until(stop).map_err(StoreError::io(path))?.ok_or(StoreError::Cancelled)?;
        folder::replace(files, path, &bytes)
    }

    /// Encodes the snapshot as the bytes of a map file.
    ///
    /// # Errors
    /// When compression fails, for want of memory.
    pub fn encode(&self) -> std::io::Result<Vec<u8>> {
        // It is never stopped.
        self.encode_until(StopSignal::NEVER).map(Option::unwrap_or_default)
    }

    /// [`Snapshot::encode`] under a stop signal; none once stopped.
    ///
    /// # Errors
    /// As for [`Snapshot::encode`].
    pub fn encode_until(&self, stop: StopSignal<'_>) -> std::io::Result<Option<Vec<u8>>> {
        self.encode_with(&self.contents.viewpoints, stop)
    }

    /// Encodes the snapshot for its map's folder, where its viewpoints lie in parts; [`complete`] names them.
    pub(crate) fn encode_without_viewpoints(&self) -> std::io::Result<Vec<u8>> {
        self.encode_with(&ViewpointSet::default(), StopSignal::NEVER).map(Option::unwrap_or_default)
    }

    fn encode_with(
        &self,
        viewpoints: &ViewpointSet,
        stop: StopSignal<'_>,
    ) -> std::io::Result<Option<Vec<u8>>> {
        let body = body_of(self, viewpoints, stop);
        if stop.is_stopped() {
            return Ok(None);
        }
        let mut bytes = compress_onto(begun(body.len(), self.contents.revision, self.uuid), &body, stop)?;
        if stop.is_stopped() {
            return Ok(None);
        }
        set_checksum(&mut bytes, stop);
        Ok(Some(bytes).filter(|_| !stop.is_stopped()))
    }
}
