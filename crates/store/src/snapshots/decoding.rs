//! A snapshot read from the bytes of a map file.

use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

use super::body::Body;
use super::header::{Frames, checked_frames};
use super::limits::{MapFileError, MapFileLimits, Memory};
use super::snapshot::Snapshot;
use crate::codec::Unreadable;
use crate::compression::{WINDOW_BYTES, decompress};
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder;
use crate::viewpoint_parts::{self, PartUse, uses_in};
use mrol_map::util::StopSignal;

impl Snapshot {
    /// Reads the file at `path`, with the viewpoints that lie in parts beside it.
    ///
    /// # Errors
    /// When the file cannot be read, is not a map file, is damaged, or was written by a newer version.
    pub fn read(files: &dyn FileSystem, path: &Path) -> Result<Self, StoreError> {
        Self::read_until(files, path, StopSignal::NEVER)
    }

    /// [`Snapshot::read`] under a stop signal.
    ///
    /// # Errors
    /// As for [`Snapshot::read`]; `Cancelled` once stopped.
    pub fn read_until(files: &dyn FileSystem, path: &Path, stop: StopSignal<'_>) -> Result<Self, StoreError> {
        let bytes = folder::read_until(files, path, stop)?;
        let decoded = Self::decode_own(&bytes, stop)?;
        let (mut snapshot, parts) = decoded.map_err(|reason| StoreError::damaged(path, reason))?;
        if !parts.is_empty() {
            let of = folder::folder_of(path);
            let loaded = viewpoint_parts::load(files, of, snapshot.uuid, &parts, stop)?;
            snapshot.contents.viewpoints = Arc::new(loaded.viewpoints);
        }
        Ok(snapshot)
    }

    /// Decodes a map file that is known to be a server's own: the inverse of [`Snapshot::encode`].
    ///
    /// # Errors
    /// A description of what is wrong with the bytes, and where.
    pub fn decode(bytes: &[u8]) -> Result<Self, Unreadable> {
        let decoded = Self::decode_within(bytes, &MapFileLimits::OWN, |_| Ok::<_, Infallible>(()));
        decoded.map_err(|refusal| refusal.to_string())
    }

    /// Decodes a map file from an unknown source. `reserve` is called with the bytes of each part before it is built,
    /// when all parts before it exist.
    ///
    /// # Errors
    /// When something is wrong with the bytes, they hold more than `limits` allow, or `reserve` refuses.
    pub fn decode_within<E>(
        bytes: &[u8],
        limits: &MapFileLimits,
        reserve: impl FnMut(u64) -> Result<(), E>,
    ) -> Result<Self, MapFileError<E>> {
        Self::decode_until(bytes, limits, reserve, StopSignal::NEVER)
    }

    /// [`Snapshot::decode_within`] under a stop signal.
    ///
    /// # Errors
    /// As for [`Snapshot::decode_within`]; `Stopped` once stopped.
    pub fn decode_until<E>(
        bytes: &[u8],
        limits: &MapFileLimits,
        reserve: impl FnMut(u64) -> Result<(), E>,
        stop: StopSignal<'_>,
    ) -> Result<Self, MapFileError<E>> {
        match Self::decode_but_parts(bytes, limits, reserve, stop)? {
            (snapshot, parts) if parts.is_empty() => Ok(snapshot),
            (_, parts) => Err(format!(
                "its viewpoints lie in {} files beside it, in its map's folder: `mrol snapshot` makes one file of a map",
                parts.len()
            )
            .into()),
        }
    }

    /// [`Snapshot::decode_until`] of a file that may lie in a map's folder: without the viewpoints that lie in parts,
    /// which it names.
    pub(crate) fn decode_but_parts<E>(
        bytes: &[u8],
        limits: &MapFileLimits,
        reserve: impl FnMut(u64) -> Result<(), E>,
        stop: StopSignal<'_>,
    ) -> Result<(Self, Vec<PartUse>), MapFileError<E>> {
        let decoded = Self::decode_paced(bytes, limits, &mut Memory(reserve), stop);
        // A part that was read incompletely looks like damage.
        if stop.is_stopped() { Err(MapFileError::Stopped) } else { decoded }
    }

    /// Decodes a map file of a server's own under a stop signal, but for the viewpoints that lie in parts.
    ///
    /// # Errors
    /// `Cancelled` once stopped; else what is wrong with the bytes.
    pub(crate) fn decode_own(
        bytes: &[u8],
        stop: StopSignal<'_>,
    ) -> Result<Result<(Self, Vec<PartUse>), Unreadable>, StoreError> {
        match Self::decode_but_parts(bytes, &MapFileLimits::OWN, |_| Ok::<_, Infallible>(()), stop) {
            Err(MapFileError::Stopped) => Err(StoreError::Cancelled),
            decoded => Ok(decoded.map_err(|refusal| refusal.to_string())),
        }
    }

    fn decode_paced<E>(
        bytes: &[u8],
        limits: &MapFileLimits,
        memory: &mut Memory<impl FnMut(u64) -> Result<(), E>>,
        stop: StopSignal<'_>,
    ) -> Result<(Self, Vec<PartUse>), MapFileError<E>> {
        let Frames { parts, body: compressed, body_bytes: length } = checked_frames(bytes, stop)?;
        let most = limits.body_bytes_max;
        if length > most {
            return Err(format!("a body of {length} bytes, at most {most} are read").into());
        }
        // A frame of fewer bytes contradicts the header, and is refused as well.
        memory.reserve(length as usize + WINDOW_BYTES.min(length as usize))?;
        let body = decompress(compressed, length as usize, stop)
            .map_err(|e| format!("the body from offset {} on: {e}", bytes.len() - compressed.len()))?;
        let snapshot = Body::of(&body, stop).map_err(|e| format!("the body: {e}"))?.read(limits, memory)?;
        let parts = uses_in(parts)?;
        let last = parts.iter().filter_map(|part| part.revisions.last()).max();
        if let Some(late) = last.filter(|last| **last > snapshot.contents.revision) {
            let revision = snapshot.contents.revision;
            return Err(format!("a viewpoint of revision {late} in a part, the map is at {revision}").into());
        }
        if !parts.is_empty() && !snapshot.contents.viewpoints.is_empty() {
            return Err("viewpoints in its body as well as in parts".to_owned().into());
        }
        Ok((snapshot, parts))
    }
}
