//! What the store asks of a file system, and no more: tests put one in its place that fails on demand.

use std::fmt::Debug;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

use super::StoreMode;
use crate::util::StopSignal;

/// Bytes that are read between two looks at the stop signal: some ten milliseconds of a slow disk.
const BYTES_PER_LOOK: u64 = 4 << 20;

/// The operations that maps are kept with.
///
/// Nothing is durable before it is synced: the bytes of a file by [`Appending::sync`] or [`FileSystem::sync`], the
/// names in a folder (files made, renamed, removed) by [`FileSystem::sync`] of the folder.
pub trait FileSystem: Debug + Send + Sync {
    /// Makes a folder and those above it; fine where it is there.
    ///
    /// # Errors
    /// Those of the system, here and below.
    fn create_folder(&self, folder: &Path) -> io::Result<()>;

    /// The names in a folder, in order.
    ///
    /// # Errors
    /// See above.
    fn list(&self, folder: &Path) -> io::Result<Vec<String>>;

    /// A file's bytes.
    ///
    /// # Errors
    /// See above.
    fn read(&self, file: &Path) -> io::Result<Vec<u8>>;

    /// A file's bytes, for as long as somebody wants them; none once stopped.
    ///
    /// # Errors
    /// See above.
    fn read_until(&self, file: &Path, stop: StopSignal<'_>) -> io::Result<Option<Vec<u8>>> {
        self.read(file).map(|bytes| Some(bytes).filter(|_| !stop.is_stopped()))
    }

    /// The first bytes of a file: so many, or all where there are fewer.
    ///
    /// # Errors
    /// See above.
    fn read_start(&self, file: &Path, bytes: usize) -> io::Result<Vec<u8>> {
        let mut start = self.read(file)?;
        start.truncate(bytes);
        Ok(start)
    }

    /// A file's size in bytes.
    ///
    /// # Errors
    /// See above.
    fn size(&self, file: &Path) -> io::Result<u64>;

    /// An empty file to append to, in the place of one that is there.
    ///
    /// # Errors
    /// See above.
    fn create(&self, file: &Path) -> io::Result<Box<dyn Appending>>;

    /// Cuts a file off after `bytes`.
    ///
    /// # Errors
    /// See above.
    fn truncate(&self, file: &Path, bytes: u64) -> io::Result<()>;

    /// Makes a file's bytes, or a folder's names, durable.
    ///
    /// # Errors
    /// See above.
    fn sync(&self, path: &Path) -> io::Result<()>;

    /// Renames a file or a folder, in the place of a file that is there.
    ///
    /// # Errors
    /// See above.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;

    /// Removes a file.
    ///
    /// # Errors
    /// See above.
    fn remove(&self, file: &Path) -> io::Result<()>;

    /// Removes a folder and all in it.
    ///
    /// # Errors
    /// See above.
    fn remove_folder(&self, folder: &Path) -> io::Result<()>;
}

/// A file that grows at its end.
pub trait Appending: Debug + Send {
    /// Appends all of `bytes`.
    ///
    /// # Errors
    /// Those of the system; a part of the bytes may be in the file then.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Makes all that was appended durable.
    ///
    /// # Errors
    /// Those of the system. What is durable is then unknown, and asking again would not tell: the system may have
    /// dropped what it could not write.
    fn sync(&mut self) -> io::Result<()>;
}

/// The file system of this machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Disk {
    mode: Option<StoreMode>,
}

impl Disk {
    /// The file system, where files and folders are made with the permissions `mode`, not with those of the process.
    pub fn of_mode(mode: StoreMode) -> Self {
        Self { mode: Some(mode) }
    }

    /// How a file is made that is to be written.
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
            if Read::by_ref(&mut file).take(BYTES_PER_LOOK).read_to_end(&mut bytes)? == 0 {
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
