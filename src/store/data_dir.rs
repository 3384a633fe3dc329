//! The folder where a server keeps its maps.
//!
//! ```text
//! DATA_DIR/lock                   held by the one process that uses the folder
//! DATA_DIR/maps/NAME/             a map, see `map_folder.rs`
//! DATA_DIR/maps/NAME.mrol         a map file (of version 1, a backup, of `mrol map --out`): taken in when it is found
//! DATA_DIR/maps/.unfinished-...   what a crash left: swept away
//! ```
//!
//! The folder *is* the catalogue. A map's name is its folder's; uuid and settings are in each of its snapshots. That
//! a map is made or deleted is one rename of its folder, which is atomic, so there is no second store that could
//! disagree with the files, and nothing to repair between the two. Likewise requests: which scans and deletions were
//! accepted is part of the changes themselves, durable in the same record.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use uuid::Uuid;

use super::map_folder::{MapFolder, OpenedMap};
use super::{Disk, FileSystem, OpeningProgress, Snapshot, StoreError, StoreSettings, folder, snapshot_files};
use crate::map::MapName;

const MAPS: &str = "maps";
const LOCK_FILE: &str = "lock";
const MAP_FILE_SUFFIX: &str = ".mrol";

/// The folder where a server keeps its maps. Only one process may hold it.
#[derive(Debug)]
pub struct DataDir {
    files: Arc<dyn FileSystem>,
    maps: PathBuf,
    settings: StoreSettings,
    /// Locked as long as it is open.
    _lock: Option<File>,
}

impl DataDir {
    /// Takes the folder, and makes it where it is not there.
    ///
    /// # Errors
    /// When another process holds it or the system refuses.
    pub fn open(path: &Path, settings: StoreSettings) -> Result<Self, StoreError> {
        make_folder(&Disk, path).map_err(StoreError::io(path))?;
        let lock_path = path.join(LOCK_FILE);
        let lock = File::create(&lock_path).map_err(StoreError::io(&lock_path))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { _lock: Some(lock), ..Self::on(Arc::new(Disk), path, settings)? }),
            Err(TryLockError::WouldBlock) => Err(StoreError::InUse(path.to_owned())),
            Err(TryLockError::Error(e)) => Err(StoreError::io(lock_path)(e)),
        }
    }

    /// The same on another file system, where nobody else is.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn on(files: Arc<dyn FileSystem>, path: &Path, settings: StoreSettings) -> Result<Self, StoreError> {
        let maps = path.join(MAPS);
        let make = || make_folder(&*files, path).and_then(|()| make_folder(&*files, &maps));
        make().map_err(StoreError::io(&maps))?;
        Ok(Self { files, maps, settings, _lock: None })
    }

    /// The names of the maps kept here, in order; map files that lie about become maps, and what a crash left
    /// unfinished goes.
    ///
    /// # Errors
    /// When the folder or a map file cannot be read.
    pub fn take_stock(&self) -> Result<Vec<MapName>, StoreError> {
        folder::sweep(&*self.files, &self.maps)?;
        let entries = self.files.list(&self.maps).map_err(StoreError::io(&self.maps))?;
        for name in entries.iter().filter_map(|entry| entry.strip_suffix(MAP_FILE_SUFFIX)) {
            if let Ok(name) = MapName::new(name) {
                self.take_in(&name, entries.iter().any(|entry| entry == name.as_str()))?;
            }
        }
        self.names()
    }

    /// The names of the maps kept here, in order.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn names(&self) -> Result<Vec<MapName>, StoreError> {
        let entries = self.files.list(&self.maps).map_err(StoreError::io(&self.maps))?;
        Ok(entries.iter().filter_map(|entry| MapName::new(entry).ok()).collect())
    }

    /// Makes a map's folder of a map file.
    fn take_in(&self, name: &MapName, exists: bool) -> Result<(), StoreError> {
        let file = self.maps.join(format!("{name}{MAP_FILE_SUFFIX}"));
        let snapshot = Snapshot::read(&*self.files, &file)?;
        if !exists {
            MapFolder::create(&self.files, &self.path(name), &snapshot)?;
        } else if self.first_snapshot(name)?.uuid != snapshot.uuid {
            let reason = format!("map {name} exists already: rename the file, or move it away");
            return Err(StoreError::damaged(&file, reason));
        }
        // Where a crash came between the two, the folder is there and only the file has to go.
        let removed = self.files.remove(&file).and_then(|()| self.files.sync(&self.maps));
        removed.map_err(StoreError::io(&file))
    }

    fn first_snapshot(&self, name: &MapName) -> Result<Snapshot, StoreError> {
        let path = self.path(name);
        let oldest =
            snapshot_files::snapshot_revisions(&*self.files, &path)?.first().copied().unwrap_or_default();
        Snapshot::read(&*self.files, &path.join(snapshot_files::snapshot_name(oldest)))
    }

    /// Counts what opening the maps `names` will take.
    ///
    /// # Errors
    /// When a folder cannot be read.
    pub fn expect(&self, names: &[MapName], progress: &OpeningProgress) -> Result<(), StoreError> {
        for name in names {
            progress.expect_map(snapshot_files::bytes_to_read(&*self.files, &self.path(name))?);
        }
        Ok(())
    }

    /// Opens a map.
    ///
    /// # Errors
    /// When its files cannot be read, or miss something that may have been acknowledged.
    pub fn map(&self, name: &MapName, progress: &OpeningProgress) -> Result<OpenedMap, StoreError> {
        let files = Arc::clone(&self.files);
        let opened = MapFolder::open(files, self.path(name), self.settings.clone(), progress)?;
        progress.map_is_open();
        Ok(opened)
    }

    /// Makes a map; it is there as a whole or not at all.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn create(&self, name: &MapName, first: &Snapshot) -> Result<MapFolder, StoreError> {
        let path = self.path(name);
        MapFolder::create(&self.files, &path, first)?;
        MapFolder::new(Arc::clone(&self.files), path, self.settings.clone(), first)
    }

    /// Takes a map away. When this returns it is gone for good, though not all its bytes may be.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn remove(&self, name: &MapName, uuid: Uuid) -> Result<(), StoreError> {
        let path = self.path(name);
        // With the uuid, since the name may come again and go again.
        let gone = folder::unfinished(&self.maps.join(format!("{name}-{uuid}")));
        let renamed = self.files.rename(&path, &gone).and_then(|()| self.files.sync(&self.maps));
        renamed.map_err(StoreError::io(&path))?;
        // What is left is swept away at the next start.
        drop(self.files.remove_folder(&gone));
        Ok(())
    }

    pub(super) fn files(&self) -> &Arc<dyn FileSystem> {
        &self.files
    }

    /// A map's name can be no path, see [`MapName`].
    pub(super) fn path(&self, name: &MapName) -> PathBuf {
        self.maps.join(name.as_str())
    }
}

/// Makes a folder, and its name in the one above durable, where it is not there.
fn make_folder(files: &dyn FileSystem, folder: &Path) -> std::io::Result<()> {
    if files.list(folder).is_ok() {
        return Ok(());
    }
    files.create_folder(folder)?;
    files.sync(folder::folder_of(folder))
}
