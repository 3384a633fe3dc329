//! Folders and files that are whole or not there.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{FileSystem, StoreError};
use crate::sync::{Mutex, Rank};
use crate::util::StopSignal;

/// Where a folder is, for all who use it: a map may get another name while it is open.
#[derive(Debug, Clone)]
pub(super) struct FolderPath(Arc<Mutex<PathBuf>>);

impl FolderPath {
    pub(super) fn new(path: PathBuf) -> Self {
        Self(Arc::new(Mutex::new(Rank::Brief, path)))
    }

    pub(super) fn get(&self) -> PathBuf {
        self.0.lock().clone()
    }

    pub(super) fn set(&self, path: PathBuf) {
        *self.0.lock() = path;
    }

    /// The file of that name.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.0.lock().join(name)
    }
}

/// What the name of something unfinished begins with: swept away when it is found.
pub(super) const UNFINISHED: &str = ".unfinished-";

/// Where a path is made before it gets its name.
pub(super) fn unfinished(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{UNFINISHED}{name}"))
}

/// Writes `bytes` to a file beside `path`, syncs it, renames it over `path` and syncs the folder: after a crash at
/// any moment `path` holds the old bytes or the new.
///
/// # Errors
/// When the system refuses; `path` is then as it was, or, where the folder could not be synced, new. Nothing else is
/// left that takes room.
pub(super) fn replace(files: &dyn FileSystem, path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let aside = unfinished(path);
    let write = || {
        let mut file = files.create(&aside)?;
        file.append(bytes)?;
        file.sync()?;
        drop(file);
        files.rename(&aside, path)?;
        files.sync(folder_of(path))
    };
    // What is left of it takes the room that is missing.
    let left = |_: &std::io::Error| drop(files.remove(&aside));
    write().inspect_err(left).map_err(StoreError::io(path))
}

/// The bytes of the file at `path`, for as long as somebody wants them.
///
/// # Errors
/// When the system refuses; `Cancelled` once stopped.
pub(super) fn read_until(
    files: &dyn FileSystem,
    path: &Path,
    stop: StopSignal<'_>,
) -> Result<Vec<u8>, StoreError> {
    files.read_until(path, stop).map_err(StoreError::io(path))?.ok_or(StoreError::Cancelled)
}

/// Removes what a crash left unfinished in `folder`.
///
/// # Errors
/// When the system refuses.
pub(super) fn sweep(files: &dyn FileSystem, folder: &Path) -> Result<(), StoreError> {
    for name in files.list(folder).map_err(StoreError::io(folder))? {
        if name.starts_with(UNFINISHED) {
            let path = folder.join(name);
            files.remove(&path).or_else(|_| files.remove_folder(&path)).map_err(StoreError::io(&path))?;
        }
    }
    Ok(())
}

/// Bytes of the files in `folder`; what the system does not tell counts for nothing.
pub(super) fn bytes_in(files: &dyn FileSystem, folder: &Path) -> u64 {
    let names = files.list(folder).unwrap_or_default();
    names.iter().filter_map(|name| files.size(&folder.join(name)).ok()).sum()
}

/// The folder that a file is in.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
