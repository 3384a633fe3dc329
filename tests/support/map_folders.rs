//! Where a server keeps a map: a folder of the map's name and uuid; copies of data folders.

use std::path::{Path, PathBuf};

/// The folder of the map `map` in the data folder `data`.
pub fn folder_of(data: &Path, map: &str) -> PathBuf {
    let entries = std::fs::read_dir(data.join("maps")).expect("a data folder");
    let name = |path: &PathBuf| path.file_name().expect("a name").to_string_lossy().into_owned();
    let mut folders = entries.map(|entry| entry.expect("an entry").path());
    let is_its = |path: &PathBuf| path.is_dir() && name(path).split('.').next() == Some(map);
    folders.find(is_its).unwrap_or_else(|| panic!("no folder of map {map}"))
}

/// Copies a folder with all that is in it, as a backup of a data folder does whose server is down.
pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder").map(|entry| entry.expect("an entry")) {
        let to = to.join(entry.file_name());
        match entry.file_type().expect("its type").is_dir() {
            true => copy_folder(&entry.path(), &to),
            false => drop(std::fs::copy(entry.path(), to).expect("a copy")),
        }
    }
}
