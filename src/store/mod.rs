//! Maps on disk: the snapshot of a map, and files that are written beside and renamed.

mod file;
mod snapshot;

pub use file::{DataDir, write_beside_and_rename};
pub use snapshot::{FORMAT_VERSION, Snapshot};

use std::path::PathBuf;

/// Why a map could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The system said no.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Another process uses the data folder.
    #[error("{} is in use by another server: stop it, or choose another data folder", .0.display())]
    InUse(PathBuf),
    /// The file is none of ours, damaged, or of a newer version.
    #[error("{}: {reason}", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}

impl StoreError {
    fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }
}
