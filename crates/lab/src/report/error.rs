//! Errors of a report.

use std::io;
use std::path::{Path, PathBuf};

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file or folder cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// Path of the file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The plot cannot be drawn.
    #[error("{}: cannot be drawn: {reason}", path.display())]
    Draw {
        /// Path of the plot.
        path: PathBuf,
        /// What the plotting library said.
        reason: String,
    },
}

impl ReportError {
    pub(super) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Write { path: path.to_owned(), source }
    }
}
