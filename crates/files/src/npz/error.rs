//! Why arrays cannot be read.

use std::io;

use mrol_map::scan::ArrayHeaderError;
use mrol_map::voxel::{INDEX_MAX, INDEX_MIN, RESOLUTION_MAX_M, RESOLUTION_MIN_M};
use zip::result::ZipError;

/// Why the arrays of a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// The file is no archive of arrays.
    #[error("no .npz of numpy: {0}")]
    Archive(String),
    /// An array that is needed is not there.
    #[error("it has neither the arrays indices and resolution nor the array points; it has {0}")]
    Lacking(String),
    /// An array cannot be read.
    #[error("array {name}: {problem}")]
    Array {
        /// Its name.
        name: &'static str,
        /// Why.
        problem: String,
    },
    /// Voxels that no map can have.
    #[error("resolution {0} m: that of a map is {RESOLUTION_MIN_M} to {RESOLUTION_MAX_M} m")]
    Resolution(f64),
    /// An index that no voxel has.
    #[error(
        "array indices, row {row}: {index:?}, and those of a voxel are whole numbers from {INDEX_MIN} to {INDEX_MAX}"
    )]
    Index {
        /// Counted from 0.
        row: u64,
        /// What is there.
        index: [f64; 3],
    },
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
}

impl NpzError {
    pub(super) fn array(name: &'static str, problem: impl std::fmt::Display) -> Self {
        Self::Array { name, problem: problem.to_string() }
    }

    pub(super) fn header(name: &'static str) -> impl FnOnce(ArrayHeaderError) -> Self {
        move |error| Self::array(name, error)
    }
}

impl From<ZipError> for NpzError {
    fn from(error: ZipError) -> Self {
        match error {
            ZipError::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => Self::Io(error),
            _ => Self::Archive(error.to_string()),
        }
    }
}
