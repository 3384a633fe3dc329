//! The data folder in use: its maps are opened, created, replaced and removed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use uuid::Uuid;

use crate::checked_files::CheckedFiles;
use crate::entry::Entry;
use crate::error::StoreError;
use crate::file_system::{Disk, FileSystem};
use crate::folder;
use crate::map_files::{self, MapFolder, OpenedMap, newest_good};
use crate::progress::OpeningProgress;
use crate::replacement::{self, REPLACES, Replacement};
use crate::settings::StoreSettings;
use crate::snapshots::Snapshot;
use mrol_map::map::MapName;
use mrol_map::sync::{Mutex, Rank};
use mrol_map::util::StopSignal;

const MAPS: &str = "maps";
const LOCK_FILE: &str = "lock";

/// How long a lock that another process holds is waited for.
const LOCK_WAIT_MAX: Duration = Duration::from_secs(1);
/// How long until it is tried again.
const LOCK_RETRY: Duration = Duration::from_millis(20);

/// The data folder, where a server keeps its maps. One process may hold it at a time.
#[derive(Debug)]
pub struct DataDir {
    pub(crate) files: Arc<dyn FileSystem>,
    pub(crate) maps: PathBuf,
    settings: StoreSettings,
    /// Names of folders of maps that were deleted or never completed, which may still be there because removing them
    /// failed.
    leftovers: Mutex<BTreeSet<String>>,
    /// Lock file, locked as long as it is open.
    _lock: Option<File>,
}

impl DataDir {
    /// Opens the data folder, creates it where it does not exist, and locks it. A server that is just ending, or a
    /// process that inherits the lock for the moment until its program starts, is waited for, up to a second.
    ///
    /// # Errors
    /// When another process holds it for longer or the system refuses.
    pub fn open(path: &Path, settings: StoreSettings) -> Result<Self, StoreError> {
        let disk = Disk::of_mode(settings.mode);
        make_folder(&disk, path).map_err(StoreError::io(path))?;
        let lock_path = path.join(LOCK_FILE);
        let lock = disk.creation().open(&lock_path).map_err(StoreError::io(&lock_path))?;
        let begin = Instant::now();
        loop {
            match lock.try_lock() {
                Ok(()) => break,
                Err(TryLockError::WouldBlock) if begin.elapsed() < LOCK_WAIT_MAX => thread::sleep(LOCK_RETRY),
                Err(TryLockError::WouldBlock) => return Err(StoreError::InUse(path.to_owned())),
                Err(TryLockError::Error(e)) => return Err(StoreError::io(lock_path)(e)),
            }
        }
        Ok(Self { _lock: Some(lock), ..Self::on(Arc::new(disk), path, settings)? })
    }

    /// Opens the data folder on another file system, without a lock.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn on(files: Arc<dyn FileSystem>, path: &Path, settings: StoreSettings) -> Result<Self, StoreError> {
        let (files, maps) = (CheckedFiles::around(files), path.join(MAPS));
        let make = || make_folder(&*files, path).and_then(|()| make_folder(&*files, &maps));
        make().map_err(StoreError::io(&maps))?;
        let leftovers = Mutex::new(Rank::Brief, BTreeSet::new());
        Ok(Self { files, maps, settings, leftovers, _lock: None })
    }

    /// Names of the maps in the folder, sorted, including those that cannot be opened.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn names(&self) -> Result<Vec<MapName>, StoreError> {
        let names = self.entries()?.iter().filter_map(|entry| Entry::of(entry).into_map()).collect();
        Ok(BTreeSet::into_iter(names).collect())
    }

    /// Opens a map.
    ///
    /// # Errors
    /// When its files cannot be read, something is missing that may have been acknowledged, or two folders claim to be
    /// the map.
    pub fn map(&self, name: &MapName, progress: &OpeningProgress) -> Result<OpenedMap, StoreError> {
        self.map_of(name, &self.folders_of(name)?, progress)
    }

    /// [`DataDir::map`], where the folders that claim to be the map were listed before.
    ///
    /// # Errors
    /// As for [`DataDir::map`].
    pub fn map_of(
        &self,
        name: &MapName,
        folders: &[String],
        progress: &OpeningProgress,
    ) -> Result<OpenedMap, StoreError> {
        let (path, uuid) = self.adopted(self.path_of(name, folders)?, name, progress)?;
        let files = Arc::clone(&self.files);
        let opened = MapFolder::open(files, path, uuid, self.settings.clone(), progress)?;
        progress.map_is_open();
        Ok(opened)
    }

    /// Creates a map, as a whole or not at all.
    ///
    /// # Errors
    /// When the system refuses, or there is a map of that name.
    pub fn create(&self, name: &MapName, first: &Snapshot) -> Result<MapFolder, StoreError> {
        self.clear_leftovers()?;
        if let Some(entry) = self.folders_of(name)?.into_iter().next() {
            return Err(StoreError::damaged(&self.maps.join(entry), format!("map {name} exists")));
        }
        let entry = Entry::folder_name(name, first.uuid);
        self.make(&entry, first, None, StopSignal::NEVER)?;
        self.folder(&entry, first).inspect_err(|_| self.leave(&entry))
    }

    /// Creates a map in the place of `old` under its name `name`; the old map is renamed to `kept`. A newer state of
    /// the same map would have the same folder: after a crash in between there is only the old one, under the name
    /// `kept`.
    ///
    /// # Errors
    /// When the system refuses; in memory, all is then as it was. Where undoing a part of it failed too, the next start
    /// may find the exchange made.
    pub fn replace(
        &self,
        name: &MapName,
        old: &MapFolder,
        kept: &MapName,
        first: &Snapshot,
    ) -> Result<MapFolder, StoreError> {
        self.clear_leftovers()?;
        let new = Entry::folder_name(name, first.uuid);
        if new == name_of(&old.path()) {
            let there = old.path();
            old.move_to(&self.maps.join(Entry::folder_name(kept, old.uuid())))?;
            return self.create(name, first).inspect_err(|_| drop(old.move_to(&there)));
        }
        let replacement =
            Replacement { old: name_of(&old.path()), kept: Entry::folder_name(kept, old.uuid()) };
        self.make(&new, first, Some(&replacement), StopSignal::NEVER)?;
        // It is not used before it is known to stay.
        let exchange = || {
            let folder = self.folder(&new, first)?;
            old.move_to(&self.maps.join(&replacement.kept))?;
            Ok(folder)
        };
        let folder = exchange().inspect_err(|_| self.leave(&new))?;
        // Where it stays, the next start takes it away.
        drop(replacement::finish(&*self.files, &self.maps.join(&new)));
        Ok(folder)
    }

    /// Creates a map in the place of one whose files are damaged, and sets the folder of that aside as it is; returns
    /// where it lies then. Nobody uses the folder.
    ///
    /// # Errors
    /// When the system refuses. Where the new map is there already, the next start completes the exchange.
    pub(crate) fn replace_damaged(
        &self,
        name: &MapName,
        old: &Path,
        first: &Snapshot,
    ) -> Result<PathBuf, StoreError> {
        self.replace_folder(name, old, Entry::set_aside_name(&name_of(old)), first)
    }

    /// Creates a map in the place of that in the folder `old`, which nobody uses, and renames that folder to `kept`;
    /// returns where it lies then.
    ///
    /// # Errors
    /// When the system refuses. Where the new map is there already, the next start completes the exchange.
    pub(super) fn replace_folder(
        &self,
        name: &MapName,
        old: &Path,
        kept: String,
        first: &Snapshot,
    ) -> Result<PathBuf, StoreError> {
        let new = Entry::folder_name(name, first.uuid);
        let replacement = Replacement { old: name_of(old), kept };
        self.make(&new, first, Some(&replacement), StopSignal::NEVER)?;
        replacement.keep_old(&*self.files, &self.maps)?;
        replacement::finish(&*self.files, &self.maps.join(&new))?;
        Ok(self.maps.join(&replacement.kept))
    }

    /// Sets a map file aside under a name of its own, as it is; returns where it lies then.
    ///
    /// # Errors
    /// When the system refuses.
    pub(crate) fn set_file_aside(&self, name: &MapName) -> Result<PathBuf, StoreError> {
        let file = self.maps.join(Entry::file_name(name));
        let aside = self.maps.join(Entry::set_aside_name(&Entry::folder_name(name, Uuid::new_v4())));
        let renamed = self.files.rename(&file, &aside).and_then(|()| self.files.sync(&self.maps));
        renamed.map_err(StoreError::io(&file))?;
        Ok(aside)
    }

    /// Gives a map another name, in one rename of its folder: after a crash it has one of the two. It may be in use.
    ///
    /// # Errors
    /// When the system refuses, there is a map of that name, or this one was deleted. Where [`DataDir::has_name`] is
    /// true all the same, the map has its new name, and only a loss of power could bring the former back.
    pub fn rename(&self, folder: &MapFolder, to: &MapName) -> Result<(), StoreError> {
        if folder.is_gone() {
            return Err(StoreError::Gone);
        }
        self.clear_leftovers()?;
        if let Some(entry) = self.folders_of(to)?.into_iter().next() {
            return Err(StoreError::damaged(&self.maps.join(entry), format!("map {to} exists")));
        }
        let new = Entry::folder_name(to, folder.uuid());
        self.forget_replacements_of(&new)?;
        folder.move_to(&self.maps.join(new))
    }

    /// True where the folder is that of a map named `name`.
    pub fn has_name(&self, folder: &MapFolder, name: &MapName) -> bool {
        name_of(&folder.path()) == Entry::folder_name(name, folder.uuid())
    }

    /// Ends the replacements of a map whose folder was called `old`, which are done but for the file that says so: the
    /// next start would take the name away from a folder that is called so again.
    fn forget_replacements_of(&self, old: &str) -> Result<(), StoreError> {
        for entry in self.entries()? {
            if !matches!(Entry::of(&entry), Entry::Map { .. }) {
                continue;
            }
            let folder = self.maps.join(entry);
            if Replacement::in_folder(&*self.files, &folder)?.is_some_and(|found| found.old == old) {
                replacement::finish(&*self.files, &folder)?;
            }
        }
        Ok(())
    }

    /// Deletes a map. When this returns, the map is deleted for good, though its bytes may not all be freed.
    ///
    /// # Errors
    /// When the system refuses. Where [`MapFolder::is_gone`] is true all the same, the map is deleted, and only a loss
    /// of power could bring it back.
    pub fn remove(&self, folder: &MapFolder) -> Result<(), StoreError> {
        let path = folder.path();
        let gone = folder::unfinished(&path);
        folder.take_away(&gone)?;
        let name = name_of(&path);
        if let Err(error) = self.files.sync(&self.maps) {
            self.leftovers.lock().insert(name);
            return Err(StoreError::io(&path)(error));
        }
        // What is left is swept away at the next start.
        drop(self.files.remove_folder(&gone));
        Ok(())
    }

    /// Creates a map's folder with its first snapshot, as a whole or not at all.
    pub(crate) fn make(
        &self,
        entry: &str,
        first: &Snapshot,
        replaces: Option<&Replacement>,
        stop: StopSignal<'_>,
    ) -> Result<(), StoreError> {
        let path = self.maps.join(entry);
        let aside = folder::unfinished(&path);
        let make = || {
            self.files.create_folder(&aside).map_err(StoreError::io(&aside))?;
            if let Some(replaces) = replaces {
                folder::replace(&*self.files, &aside.join(REPLACES), &replaces.encode())?;
            }
            let snapshot = map_files::snapshot_name(first.contents.revision);
            first.write_until(&*self.files, &aside.join(snapshot), stop)?;
            let renamed = self.files.rename(&aside, &path).and_then(|()| self.files.sync(&self.maps));
            renamed.map_err(StoreError::io(&path))
        };
        make().inspect_err(|_| self.leave(entry))
    }

    /// The folder object of a map whose only snapshot was just written.
    fn folder(&self, entry: &str, first: &Snapshot) -> Result<MapFolder, StoreError> {
        MapFolder::new(Arc::clone(&self.files), self.maps.join(entry), self.settings.clone(), first)
    }

    /// Notes that a folder is no longer a map's, and removes it if that succeeds.
    fn leave(&self, entry: &str) {
        self.leftovers.lock().insert(entry.to_owned());
        drop(self.clear_leftovers());
    }

    /// Removes for good what failed operations left: after a crash it could not be told from the next map of the name.
    fn clear_leftovers(&self) -> Result<(), StoreError> {
        let leftovers = self.leftovers.lock().clone();
        if leftovers.is_empty() {
            return Ok(());
        }
        let entries = self.entries()?;
        for entry in &leftovers {
            let path = self.maps.join(entry);
            let aside = folder::unfinished(&path);
            if entries.contains(entry) {
                self.files.rename(&path, &aside).map_err(StoreError::io(&path))?;
            }
        }
        self.files.sync(&self.maps).map_err(StoreError::io(&self.maps))?;
        for entry in &leftovers {
            // What is left is swept away at the next start.
            drop(self.files.remove_folder(&folder::unfinished(&self.maps.join(entry))));
        }
        self.leftovers.lock().retain(|entry| !leftovers.contains(entry));
        Ok(())
    }

    pub(crate) fn entries(&self) -> Result<Vec<String>, StoreError> {
        self.files.list(&self.maps).map_err(StoreError::io(&self.maps))
    }

    /// Names of the folders that claim to be that map. Leftovers of failed operations do not count: they are removed
    /// before the next map is created.
    pub(crate) fn folders_of(&self, name: &MapName) -> Result<Vec<String>, StoreError> {
        let mut entries = self.entries()?;
        // Of thousands of entries few are read further.
        entries.retain(|entry| entry.starts_with(name.as_str()));
        let leftovers = self.leftovers.lock();
        entries
            .retain(|entry| Entry::of(entry).into_map().as_ref() == Some(name) && !leftovers.contains(entry));
        Ok(entries)
    }

    /// The folders that claim to be maps, by name: one listing for all maps.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn folders(&self) -> Result<BTreeMap<MapName, Vec<String>>, StoreError> {
        let mut folders = BTreeMap::<MapName, Vec<String>>::new();
        for entry in self.entries()? {
            if let Some(name) = Entry::of(&entry).into_map() {
                folders.entry(name).or_default().push(entry);
            }
        }
        Ok(folders)
    }

    /// The folder of a map.
    ///
    /// # Errors
    /// Where there is none, or more than one.
    pub(crate) fn path(&self, name: &MapName) -> Result<PathBuf, StoreError> {
        self.path_of(name, &self.folders_of(name)?)
    }

    /// The folder of a map of which `folders` claim to be it.
    pub(crate) fn path_of(&self, name: &MapName, folders: &[String]) -> Result<PathBuf, StoreError> {
        match folders {
            [] => Err(StoreError::NoFolder(name.clone())),
            [one] => Ok(self.maps.join(one)),
            [first, second, ..] => {
                let (first, second) = (self.maps.join(first), self.maps.join(second));
                Err(StoreError::TwoFolders { name: name.clone(), first, second })
            }
        }
    }

    /// Path of a map's folder with the uuid in its name; a folder of a former release is renamed first.
    fn adopted(
        &self,
        path: PathBuf,
        name: &MapName,
        progress: &OpeningProgress,
    ) -> Result<(PathBuf, Uuid), StoreError> {
        if let Entry::Map { uuid, .. } = Entry::of_path(&path) {
            return Ok((path, uuid));
        }
        let mut revisions = map_files::snapshot_revisions(&*self.files, &path)?;
        let newest = newest_good(&*self.files, &path, &mut revisions, progress)?;
        let uuid = newest.snapshot.uuid;
        let adopted = self.maps.join(Entry::folder_name(name, uuid));
        let renamed = self.files.rename(&path, &adopted).and_then(|()| self.files.sync(&self.maps));
        renamed.map_err(StoreError::io(&path))?;
        Ok((adopted, uuid))
    }

    pub(crate) fn files(&self) -> &Arc<dyn FileSystem> {
        &self.files
    }
}

/// The name of a folder in the folder of maps.
fn name_of(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Creates a folder where it does not exist, and makes its entry durable.
fn make_folder(files: &dyn FileSystem, folder: &Path) -> std::io::Result<()> {
    if files.list(folder).is_ok() {
        return Ok(());
    }
    files.create_folder(folder)?;
    files.sync(folder::folder_of(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_that_is_given_up_soon_is_waited_for_and_another_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let open = || DataDir::open(folder.path(), StoreSettings::default());
        let first = open().unwrap();
        assert!(matches!(open(), Err(StoreError::InUse(_))));
        thread::scope(|scope| {
            let ending = scope.spawn(|| {
                thread::sleep(3 * LOCK_RETRY);
                drop(first);
            });
            open().unwrap();
            ending.join().unwrap();
        });
    }
}
