//! A file system that checks, before each operation, that the calling thread may block on a disk.

use std::io;
use std::path::Path;
use std::sync::Arc;

use super::file_system::{Appending, FileSystem};
use mrol_map::sync::before_file_operation;
use mrol_map::util::StopSignal;

/// Wraps a file system so that operations never start while the lock of a map's content is held, nor on a thread that
/// polls async tasks; see [`mrol_map::sync`].
#[derive(Debug)]
pub(super) struct CheckedFiles(Arc<dyn FileSystem>);

impl CheckedFiles {
    pub(super) fn around(files: Arc<dyn FileSystem>) -> Arc<dyn FileSystem> {
        Arc::new(Self(files))
    }

    #[track_caller]
    fn files(&self) -> &dyn FileSystem {
        before_file_operation();
        &*self.0
    }
}

impl FileSystem for CheckedFiles {
    fn create_folder(&self, folder: &Path) -> io::Result<()> {
        self.files().create_folder(folder)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<String>> {
        self.files().list(folder)
    }

    fn read(&self, file: &Path) -> io::Result<Vec<u8>> {
        self.files().read(file)
    }

    fn read_until(&self, file: &Path, stop: StopSignal<'_>) -> io::Result<Option<Vec<u8>>> {
        self.files().read_until(file, stop)
    }

    fn read_start(&self, file: &Path, bytes: usize) -> io::Result<Vec<u8>> {
        self.files().read_start(file, bytes)
    }

    fn size(&self, file: &Path) -> io::Result<u64> {
        self.files().size(file)
    }

    fn create(&self, file: &Path) -> io::Result<Box<dyn Appending>> {
        Ok(Box::new(CheckedFile(self.files().create(file)?)))
    }

    fn truncate(&self, file: &Path, bytes: u64) -> io::Result<()> {
        self.files().truncate(file, bytes)
    }

    fn sync(&self, path: &Path) -> io::Result<()> {
        self.files().sync(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.files().rename(from, to)
    }

    fn remove(&self, file: &Path) -> io::Result<()> {
        self.files().remove(file)
    }

    fn remove_folder(&self, folder: &Path) -> io::Result<()> {
        self.files().remove_folder(folder)
    }
}

#[derive(Debug)]
struct CheckedFile(Box<dyn Appending>);

impl Appending for CheckedFile {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        before_file_operation();
        self.0.append(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        before_file_operation();
        self.0.sync()
    }
}
