//! A map that takes another's place under its name.
//!
//! ```text
//!                        maps/office.OLD/
//! made aside             maps/office.OLD/                      maps/.unfinished-office.NEW/replaces
//! exchanged: one rename  maps/office.OLD/                      maps/office.NEW/replaces
//! kept                   maps/office-replaced-41.OLD/          maps/office.NEW/replaces
//! done                   maps/office-replaced-41.OLD/          maps/office.NEW/
//! ```
//!
//! The file `replaces` names the folder of the map that was there, and the one that it gets. As long as it is there the
//! next start goes on where a crash came, so that there is one map of the name at every moment.

use std::path::Path;

use super::entry::Entry;
use super::{FileSystem, StoreError, folder};

/// The file in the new map's folder.
pub(super) const REPLACES: &str = "replaces";

/// What the file says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Replacement {
    /// The name of the folder of the map that was there.
    pub(super) old: String,
    /// The one that it gets.
    pub(super) kept: String,
}

impl Replacement {
    /// The file's bytes.
    pub(super) fn encode(&self) -> Vec<u8> {
        format!("{}\n{}\n", self.old, self.kept).into_bytes()
    }

    /// What the file in `folder` says, where there is one.
    pub(super) fn in_folder(files: &dyn FileSystem, folder: &Path) -> Result<Option<Self>, StoreError> {
        let names = files.list(folder).map_err(StoreError::io(folder))?;
        if !names.iter().any(|name| name == REPLACES) {
            return Ok(None);
        }
        let path = folder.join(REPLACES);
        let bytes = files.read(&path).map_err(StoreError::io(&path))?;
        let text = String::from_utf8_lossy(&bytes);
        let mut lines = text.lines();
        let mut folder_name =
            || lines.next().filter(|line| matches!(Entry::of(line), Entry::Map { .. })).map(str::to_owned);
        match (folder_name(), folder_name()) {
            (Some(old), Some(kept)) => Ok(Some(Self { old, kept })),
            _ => Err(StoreError::damaged(&path, "it names no two folders of maps")),
        }
    }

    /// Gives the old map's folder its name, where it has the one of before.
    pub(super) fn keep_old(&self, files: &dyn FileSystem, maps: &Path) -> Result<(), StoreError> {
        let (old, kept) = (maps.join(&self.old), maps.join(&self.kept));
        if files.list(&old).is_err() {
            return Ok(());
        }
        let renamed = files.rename(&old, &kept).and_then(|()| files.sync(maps));
        renamed.map_err(StoreError::io(old))
    }
}

/// Takes the file out of the new map's folder: all is done.
pub(super) fn finish(files: &dyn FileSystem, new: &Path) -> Result<(), StoreError> {
    let path = new.join(REPLACES);
    let removed = files.remove(&path).and_then(|()| files.sync(folder::folder_of(&path)));
    removed.map_err(StoreError::io(path))
}
