//! Contents of a data folder at a start, after repair of what a crash left.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use super::data_dir::DataDir;
use crate::entry::Entry;
use crate::error::StoreError;
use crate::progress::OpeningProgress;
use crate::replacement::{self, Replacement};
use crate::snapshots::Snapshot;
use crate::{folder, map_files};
use mrol_map::map::MapName;
use mrol_map::util::StopSignal;

/// Contents of a data folder.
#[derive(Debug, Default)]
pub struct DataDirContents {
    /// Names of the maps, sorted.
    pub maps: Vec<MapName>,
    /// Names of map files that could not become maps, and why. Their names must not be used meanwhile.
    pub refused: Vec<(MapName, StoreError)>,
    /// Files and folders that are not part of a data folder.
    pub not_understood: Vec<PathBuf>,
    /// Why leftovers of a crash could not be removed. They do no harm, and the next start tries again.
    pub not_swept: Option<StoreError>,
}

impl DataDir {
    /// Prepares the folder for use: removes what a crash left unfinished, completes interrupted replacements, and turns
    /// map files into maps.
    ///
    /// # Errors
    /// When the folder cannot be read, or the system refuses. A problem with one map does not keep the others from
    /// being opened.
    pub fn import_map_files(&self) -> Result<DataDirContents, StoreError> {
        self.import_map_files_until(&OpeningProgress::default())
    }

    /// [`DataDir::import_map_files`], unless `progress` is cancelled.
    ///
    /// # Errors
    /// As for [`DataDir::import_map_files`]; `Cancelled` once cancelled.
    pub fn import_map_files_until(&self, progress: &OpeningProgress) -> Result<DataDirContents, StoreError> {
        let not_swept = folder::sweep(&*self.files, &self.maps).err();
        let mut contents = DataDirContents { not_swept, ..DataDirContents::default() };
        self.end_replacements(&mut contents)?;
        for entry in self.entries()? {
            match Entry::of(&entry) {
                Entry::MapFile(name) => match self.take_in(&name, progress) {
                    Ok(()) => {}
                    Err(StoreError::Cancelled) => return Err(StoreError::Cancelled),
                    Err(error) => contents.refused.push((name, error)),
                },
                Entry::Unknown => contents.not_understood.push(self.maps.join(entry)),
                Entry::Map { .. } | Entry::OldMap(_) | Entry::SetAside | Entry::Unfinished => {}
            }
        }
        contents.maps = self.names()?;
        Ok(contents)
    }

    /// Paths of files and folders that are not part of a data folder.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn not_understood(&self) -> Result<Vec<PathBuf>, StoreError> {
        self.paths_of(&Entry::Unknown)
    }

    /// Folders of maps that were set aside because their files are damaged.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn set_aside(&self) -> Result<Vec<PathBuf>, StoreError> {
        self.paths_of(&Entry::SetAside)
    }

    fn paths_of(&self, meaning: &Entry) -> Result<Vec<PathBuf>, StoreError> {
        let has_it = |entry: &String| Entry::of(entry) == *meaning;
        Ok(self.entries()?.into_iter().filter(has_it).map(|entry| self.maps.join(entry)).collect())
    }

    /// Adds the bytes that opening the maps of `folders` will read to `progress`. Problems with a map are reported when
    /// it is opened.
    pub fn expect(&self, folders: &BTreeMap<MapName, Vec<String>>, progress: &OpeningProgress) {
        for (name, folders) in folders {
            let path = self.path_of(name, folders);
            let bytes = path.and_then(|path| map_files::bytes_to_read(&*self.files, &path));
            progress.expect_map(bytes.unwrap_or_default());
        }
    }

    /// Completes the replacements of maps that a crash interrupted. Where that fails, neither map of the name can be
    /// told from the other: the name is refused, and the next start tries again.
    pub(crate) fn end_replacements(&self, contents: &mut DataDirContents) -> Result<(), StoreError> {
        for entry in self.entries()? {
            let Entry::Map { name, .. } = Entry::of(&entry) else { continue };
            let new = self.maps.join(&entry);
            // Reported when the map is opened, where something is wrong with it.
            let Ok(Some(replacement)) = Replacement::in_folder(&*self.files, &new) else { continue };
            let ended = replacement.keep_old(&*self.files, &self.maps);
            if let Err(error) = ended.and_then(|()| replacement::finish(&*self.files, &new)) {
                contents.refused.push((name, error));
            }
        }
        Ok(())
    }

    /// True of a folder that holds only one snapshot, of that revision: what importing a map file leaves.
    fn holds_only(&self, entry: &str, revision: u64) -> Result<bool, StoreError> {
        let path = self.maps.join(entry);
        let names = self.files.list(&path).map_err(StoreError::io(&path))?;
        Ok(names == [map_files::snapshot_name(revision)])
    }

    /// Names of the map files that the next start turns into maps, or refuses, sorted.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn file_names(&self) -> Result<Vec<MapName>, StoreError> {
        let of_file = |entry: String| match Entry::of(&entry) {
            Entry::MapFile(name) => Some(name),
            _ => None,
        };
        let names: BTreeSet<MapName> = self.entries()?.into_iter().filter_map(of_file).collect();
        Ok(names.into_iter().collect())
    }

    /// The path of the map file of that name, and the snapshot that it holds, which may become a map of the folder.
    ///
    /// # Errors
    /// When the file cannot be read, is damaged, or there is another map of the name.
    pub(crate) fn read_file(
        &self,
        name: &MapName,
        stop: StopSignal<'_>,
    ) -> Result<(PathBuf, Snapshot), StoreError> {
        let file = self.maps.join(Entry::file_name(name));
        let snapshot = Snapshot::read_until(&*self.files, &file, stop)?;
        let taken = Entry::folder_name(name, snapshot.uuid);
        let folders = self.folders_of(name)?;
        if folders.is_empty()
            || folders.contains(&taken) && self.holds_only(&taken, snapshot.contents.revision)?
        {
            return Ok((file, snapshot));
        }
        let reason = format!(
            "map {name} exists already: rename the file, move it away, or `mrol restore --replace` it"
        );
        Err(StoreError::damaged(&file, reason))
    }

    /// Turns a map file into a map's folder.
    fn take_in(&self, name: &MapName, progress: &OpeningProgress) -> Result<(), StoreError> {
        let is_cancelled = || progress.is_cancelled();
        let stop = StopSignal::when(&is_cancelled);
        let (file, snapshot) = self.read_file(name, stop)?;
        if self.folders_of(name)?.is_empty() {
            self.make(&Entry::folder_name(name, snapshot.uuid), &snapshot, None, stop)?;
        }
        // Where a crash came between the two, the folder holds what the file does, and only the file has to go.
        let removed = self.files.remove(&file).and_then(|()| self.files.sync(&self.maps));
        removed.map_err(StoreError::io(&file))
    }
}
