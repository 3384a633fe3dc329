//! Files that are whole or not there, and the folder of them.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::{Snapshot, StoreError};
use crate::map::MapName;

const EXTENSION: &str = "mrol";
const LOCK_FILE: &str = "lock";

/// Writes `bytes` to a file beside `path`, syncs it, renames it over `path` and syncs the folder: after a crash
/// at any moment `path` holds the old bytes or the new.
///
/// # Errors
/// When the system refuses; `path` is then as it was.
pub fn write_beside_and_rename(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let write = || {
        let mut file = tempfile::Builder::new().prefix(".writing-").tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|e| e.error)?;
        File::open(folder)?.sync_all()
    };
    write().map_err(StoreError::io(path))
}

/// The folder where a server keeps its maps: `maps/NAME.mrol`. Only one process may hold it.
#[derive(Debug)]
pub struct DataDir {
    maps: PathBuf,
    /// Locked as long as it is open.
    _lock: File,
}

impl DataDir {
    /// Takes the folder, and makes it where it is not there.
    ///
    /// # Errors
    /// When another process holds it or the system refuses.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let maps = path.join("maps");
        fs::create_dir_all(&maps).map_err(StoreError::io(&maps))?;
        let lock_path = path.join(LOCK_FILE);
        let lock = File::create(&lock_path).map_err(StoreError::io(&lock_path))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { maps, _lock: lock }),
            Err(fs::TryLockError::WouldBlock) => Err(StoreError::InUse(path.to_owned())),
            Err(fs::TryLockError::Error(e)) => Err(StoreError::io(lock_path)(e)),
        }
    }

    /// The names of the maps kept here, in order.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn names(&self) -> Result<Vec<MapName>, StoreError> {
        let mut names = Vec::new();
        for entry in fs::read_dir(&self.maps).map_err(StoreError::io(&self.maps))? {
            let path = entry.map_err(StoreError::io(&self.maps))?.path();
            let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            if path.extension().is_some_and(|extension| extension == EXTENSION) {
                names.extend(MapName::new(stem).ok());
            }
        }
        names.sort_unstable();
        Ok(names)
    }

    /// Reads a map.
    ///
    /// # Errors
    /// When its file cannot be read or is damaged.
    pub fn read(&self, name: &MapName) -> Result<Snapshot, StoreError> {
        Snapshot::read(&self.path(name))
    }

    /// Writes a map in the place of its old file.
    ///
    /// # Errors
    /// When the system refuses; the old file is then still there.
    pub fn write(&self, name: &MapName, snapshot: &Snapshot) -> Result<(), StoreError> {
        snapshot.write(&self.path(name))
    }

    /// Takes a map's file away; fine where there is none.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn remove(&self, name: &MapName) -> Result<(), StoreError> {
        let path = self.path(name);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(StoreError::io(path)(e)),
            _ => File::open(&self.maps)
                .and_then(|folder| folder.sync_all())
                .map_err(StoreError::io(&self.maps)),
        }
    }

    /// A map's name can be no path, see [`MapName`].
    fn path(&self, name: &MapName) -> PathBuf {
        self.maps.join(name.as_str()).with_extension(EXTENSION)
    }
}
