//! Errors of the store.

use std::path::{Path, PathBuf};

use uuid::Uuid;

use mrol_map::map::{MapName, REVISION_MAX};

/// Why a map could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The operating system refused a file operation.
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
    /// The file is not of this program, damaged, or of a newer version.
    #[error("{}: {reason}", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The journal is damaged before its end. Something that was acknowledged may be lost, and nothing is skipped
    /// silently.
    #[error(
        "{}: damaged at offset {offset}: {reason}. Revision {revision} and what follows cannot be read; {} makes \
         a map of what comes before, and sets this one aside",
        .path.display(), set_aside_command(.path)
    )]
    JournalDamaged {
        /// The segment.
        path: PathBuf,
        /// The first byte that is wrong.
        offset: u64,
        /// What is wrong with it.
        reason: String,
        /// The first revision that is lost.
        revision: u64,
    },
    /// The journal ends before a revision that was acknowledged: files are missing.
    #[error(
        "{}: the journal ends at revision {last}, and revision {acknowledged} had been acknowledged: put the missing \
         files back; {} goes on without them",
        .folder.display(), set_aside_command(&.folder.join("journal"))
    )]
    RevisionsMissing {
        /// The map's folder.
        folder: PathBuf,
        /// The last revision in the journal.
        last: u64,
        /// The last revision that is known to have been acknowledged.
        acknowledged: u64,
    },
    /// A file in a map's folder belongs to another map.
    #[error(
        "{}: it is another map's: its uuid is {found}, that of the map is {expected}; move it away, or {} \
         makes a map without it",
        .path.display(), set_aside_command(.path)
    )]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Uuid of the map that the file belongs to.
        found: Uuid,
        /// Uuid of the map whose folder it is in.
        expected: Uuid,
    },
    /// Two folders claim to be one map.
    #[error(
        "map {name} has two folders, {} and {}: find out which one it is (`mrol doctor`), and move the other away",
        .first.display(), .second.display()
    )]
    TwoFolders {
        /// The map.
        name: MapName,
        /// The first of the folders.
        first: PathBuf,
        /// The second folder.
        second: PathBuf,
    },
    /// There is no folder of that map.
    #[error("map {0} has no folder")]
    NoFolder(MapName),
    /// The map has used up its revision numbers.
    #[error("the map is at revision {0}, and {REVISION_MAX} is the last that there is: make another map")]
    RevisionsUsedUp(u64),
    /// The map was deleted, and its folder with it.
    #[error("the map was deleted")]
    Gone,
    /// Opening was cancelled.
    #[error("the opening of the maps was ended")]
    Cancelled,
    /// A snapshot would take disk space that the journal needs.
    #[error(
        "a snapshot of {bytes} bytes does not fit on the disk, at most {bytes_max} leave enough for the journal"
    )]
    NoRoom {
        /// Size of the snapshot, bytes.
        bytes: u64,
        /// Most bytes that the snapshot may have.
        bytes_max: u64,
    },
    /// An earlier write failed, and it is unknown what the disk holds since.
    #[error("the journal stopped: {0}")]
    JournalStopped(String),
}

impl StoreError {
    pub(super) fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }

    /// The error of a segment that is damaged at `offset`, where `revision` should be.
    pub(super) fn at(path: &Path, offset: usize, revision: u64, reason: impl Into<String>) -> Self {
        let (path, offset, reason) = (path.to_owned(), offset as u64, reason.into());
        Self::JournalDamaged { path, offset, reason, revision }
    }

    /// The error of a file that is damaged, or of content that may not be written.
    pub fn damaged(path: &Path, reason: impl Into<String>) -> Self {
        Self::Damaged { path: path.to_owned(), reason: reason.into() }
    }
}

/// The command that sets aside the damaged file `DATA_DIR/maps/MAP.UUID/FILE`.
fn set_aside_command(file: &Path) -> String {
    let folder = file.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    let map = folder.split('.').next().unwrap_or_default();
    let data_dir = file.ancestors().nth(3).unwrap_or(file);
    format!("`mrol doctor {} --set-aside {map}`", data_dir.display())
}
