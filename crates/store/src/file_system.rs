//! The file operations that the store uses, as a trait, so that tests can replace them by ones that fail on demand.

use std::fmt::Debug;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

use super::mode::StoreMode;
use mrol_map::util::StopSignal;

/// Bytes that are read between two checks of the stop signal: some ten milliseconds of a slow disk.
const BYTES_PER_STOP_CHECK: u64 = 4 << 20;

/// The file operations that maps are kept with.
///
/// Nothing is durable before it is synced: the bytes of a file by [`Appending::sync`] or [`FileSystem::sync`], the
/// entries of a folder (files created, renamed, removed) by [`FileSystem::sync`] of the folder.
pub trait FileSystem: Debug + Send + Sync {
    /// Creates a folder and its parents; no error where it exists.
    ///
    /// # Errors
    /// When the system refuses; so with all operations below.
    fn create_folder(&self, folder: &Path) -> io::Result<()>;

    /// Lists the names in a folder, sorted.
    ///
    /// # Errors
    /// See above.
    fn list(&self, folder: &Path) -> io::Result<Vec<String>>;

    /// Reads all bytes of a file.
    ///
    /// # Errors
    /// See above.
    fn read(&self, file: &Path) -> io::Result<Vec<u8>>;

    /// Reads all bytes of a file; none once stopped.
    ///
    /// # Errors
    /// See above.
    fn read_until(&self, file: &Path, stop: StopSignal<'_>) -> io::Result<Option<Vec<u8>>> {
        self.read(file).map(|bytes| Some(bytes).filter(|_| !stop.is_stopped()))
    }

    /// Reads the first `bytes` bytes of a file, or all where it has fewer.
    ///
    /// # Errors
    /// See above.
    fn read_start(&self, file: &Path, bytes: usize) -> io::Result<Vec<u8>> {
        let mut start = self.read(file)?;
        start.truncate(bytes);
        Ok(start)
    }

    /// Returns a file's size in bytes.
    ///
    /// # Errors
    /// See above.
    fn size(&self, file: &Path) -> io::Result<u64>;

    /// Creates an empty file to append to, in the place of one that exists.
    ///
    /// # Errors
    /// See above.
    fn create(&self, file: &Path) -> io::Result<Box<dyn Appending>>;

    /// Truncates a file to `bytes` bytes.
    ///
    /// # Errors
    /// See above.
    fn truncate(&self, file: &Path, bytes: u64) -> io::Result<()>;

    /// Makes the bytes of a file, or the entries of a folder, durable.
    ///
    /// # Errors
    /// See above.
    fn sync(&self, path: &Path) -> io::Result<()>;

    /// Renames a file or a folder; a file of the new name is replaced.
    ///
    /// # Errors
    /// See above.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;

    /// Removes a file.
    ///
    /// # Errors
    /// See above.
    fn remove(&self, file: &Path) -> io::Result<()>;

    /// Removes a folder with all its contents.
    ///
    /// # Errors
    /// See above.
    fn remove_folder(&self, folder: &Path) -> io::Result<()>;
}

/// A file that is open for appending.
pub trait Appending: Debug + Send {
    /// Appends all of `bytes`.
    ///
    /// # Errors
    /// When the system refuses; a part of the bytes may be in the file then.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Makes everything appended so far durable.
    ///
    /// # Errors
    /// When the system refuses. What is durable is then unknown, and a second sync would not tell: the system may have
    /// dropped what it could not write.
    fn sync(&mut self) -> io::Result<()>;
}

/// The file system of this machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Disk {
    mode: Option<StoreMode>,
}

impl Disk {
    /// The file system of this machine; files and folders are created with the permissions `mode`, not with those of
    /// the process.
    pub fn of_mode(mode: StoreMode) -> Self {
        Self { mode: Some(mode) }
    }

    /// The options with which files are created for writing.
    pub(super) fn creation(self) -> OpenOptions {
        let mut options = File::options();
        options.write(true).create(true).truncate(true);
        #[cfg(unix)]
        if let Some(mode) = self.mode {
            std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode.of_files());
        }
        options
    }
}

impl FileSystem for Disk {
    fn create_folder(&self, folder: &Path) -> io::Result<()> {
        let mut builder = DirBuilder::new();
        builder.recursive(true);
        #[cfg(unix)]
        if let Some(mode) = self.mode {
            std::os::unix::fs::DirBuilderExt::mode(&mut builder, mode.of_folders());
        }
        builder.create(folder)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<String>> {
        let name = |entry: io::Result<fs::DirEntry>| Ok(entry?.file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = fs::read_dir(folder)?.map(name).collect::<io::Result<_>>()?;
        names.sort_unstable();
        Ok(names)
    }

    fn read(&self, file: &Path) -> io::Result<Vec<u8>> {
        fs::read(file)
    }

    fn read_until(&self, file: &Path, stop: StopSignal<'_>) -> io::Result<Option<Vec<u8>>> {
        let mut file = File::open(file)?;
        let mut bytes = Vec::with_capacity(file.metadata()?.len() as usize);
        while !stop.is_stopped() {
            if Read::by_ref(&mut file).take(BYTES_PER_STOP_CHECK).read_to_end(&mut bytes)? == 0 {
                return Ok(Some(bytes));
            }
        }
        Ok(None)
    }

    fn read_start(&self, file: &Path, bytes: usize) -> io::Result<Vec<u8>> {
        let mut start = Vec::new();
        File::open(file)?.take(bytes as u64).read_to_end(&mut start)?;
        Ok(start)
    }

    fn size(&self, file: &Path) -> io::Result<u64> {
        Ok(fs::metadata(file)?.len())
    }

    fn create(&self, file: &Path) -> io::Result<Box<dyn Appending>> {
        Ok(Box::new(DiskFile(self.creation().open(file)?)))
    }

    fn truncate(&self, file: &Path, bytes: u64) -> io::Result<()> {
        File::options().write(true).open(file)?.set_len(bytes)
    }

    fn sync(&self, path: &Path) -> io::Result<()> {
        File::open(path)?.sync_all()
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn remove(&self, file: &Path) -> io::Result<()> {
        fs::remove_file(file)
    }

    fn remove_folder(&self, folder: &Path) -> io::Result<()> {
        fs::remove_dir_all(folder)
    }
}

#[derive(Debug)]
struct DiskFile(File);

impl Appending for DiskFile {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        // The size is synced with it, as far as reading the bytes needs it; times are not.
        self.0.sync_data()
    }
}
