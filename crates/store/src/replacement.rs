//! Replacement of a map: a new map takes the name of another.
//!
//! ```text
//!                        maps/office.OLD/
//! made aside             maps/office.OLD/                      maps/.unfinished-office.NEW/replaces
//! exchanged: one rename  maps/office.OLD/                      maps/office.NEW/replaces
//! kept                   maps/office-replaced-41.OLD/          maps/office.NEW/replaces
//! done                   maps/office-replaced-41.OLD/          maps/office.NEW/
//! ```
//!
//! The file `replaces` names the folder of the old map, and the new name of that folder, which may be that of one that
//! is set aside, or that is to be swept away. While it exists, the next start completes what a crash interrupted, so
//! that there is one map of the name at every moment.

use std::path::Path;

use super::entry::Entry;
use super::error::StoreError;
use super::file_system::FileSystem;
use super::folder;

/// Name of the file in the new map's folder.
pub(super) const REPLACES: &str = "replaces";

/// Contents of the file `replaces`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Replacement {
    /// Name of the old map's folder.
    pub(super) old: String,
    /// New name of the old map's folder.
    pub(super) kept: String,
}

impl Replacement {
    /// Encodes the file.
    pub(super) fn encode(&self) -> Vec<u8> {
        format!("{}\n{}\n", self.old, self.kept).into_bytes()
    }

    /// Reads the file in `folder`, if there is one.
    pub(super) fn in_folder(files: &dyn FileSystem, folder: &Path) -> Result<Option<Self>, StoreError> {
        let names = files.list(folder).map_err(StoreError::io(folder))?;
        if !names.iter().any(|name| name == REPLACES) {
            return Ok(None);
        }
        let path = folder.join(REPLACES);
        let bytes = files.read(&path).map_err(StoreError::io(&path))?;
        let text = String::from_utf8_lossy(&bytes);
        let mut lines = text.lines();
        let mut folder = || lines.next().map(|line| (line.to_owned(), Entry::of(line)));
        match (folder(), folder()) {
            (Some((old, Entry::Map { .. })), Some((kept, to))) if is_a_place(&to) => {
                Ok(Some(Self { old, kept }))
            }
            _ => Err(StoreError::damaged(&path, "it names no two folders of maps")),
        }
    }

    /// Renames the old map's folder, unless that is done.
    pub(super) fn keep_old(&self, files: &dyn FileSystem, maps: &Path) -> Result<(), StoreError> {
        let (old, kept) = (maps.join(&self.old), maps.join(&self.kept));
        if files.list(&old).is_err() {
            return Ok(());
        }
        let renamed = files.rename(&old, &kept).and_then(|()| files.sync(maps));
        renamed.map_err(StoreError::io(old))
    }
}

/// True of what the folder of a map that was replaced may be called.
fn is_a_place(entry: &Entry) -> bool {
    matches!(entry, Entry::Map { .. } | Entry::SetAside | Entry::Unfinished)
}

/// Removes the file from the new map's folder, which completes the replacement.
pub(super) fn finish(files: &dyn FileSystem, new: &Path) -> Result<(), StoreError> {
    let path = new.join(REPLACES);
    let removed = files.remove(&path).and_then(|()| files.sync(folder::folder_of(&path)));
    removed.map_err(StoreError::io(path))
}
