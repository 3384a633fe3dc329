//! Atomic replacement of files and folders: a crash leaves the old or the new one, never a part.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::StoreError;
use super::file_system::FileSystem;
use mrol_map::sync::{Mutex, Rank};
use mrol_map::util::StopSignal;

/// The path of a folder, shared by all users: a map may be renamed while it is open.
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

    /// The path of the file `name` in the folder.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.0.lock().join(name)
    }
}

/// Prefix of the names of unfinished files and folders, which are removed when they are found.
pub(super) const UNFINISHED: &str = ".unfinished-";

/// The path at which `path` is prepared before it is renamed.
pub(super) fn unfinished(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{UNFINISHED}{name}"))
}

/// Replaces a file atomically: writes `bytes` to a file beside `path`, syncs it, renames it over `path` and syncs the
/// folder. After a crash at any moment `path` holds the old bytes or the new ones.
///
/// # Errors
/// When the system refuses; `path` is then as it was or, where the folder could not be synced, new. Nothing else is
/// left that takes space.
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
    // A remainder would take the space that is missing.
    let left = |_: &std::io::Error| drop(files.remove(&aside));
    write().inspect_err(left).map_err(StoreError::io(path))
}

/// Reads the file at `path` under a stop signal.
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

/// Total size of the files in `folder`, bytes; files whose size cannot be read count 0.
pub(super) fn bytes_in(files: &dyn FileSystem, folder: &Path) -> u64 {
    let names = files.list(folder).unwrap_or_default();
    names.iter().filter_map(|name| files.size(&folder.join(name)).ok()).sum()
}

/// The folder of a file.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
