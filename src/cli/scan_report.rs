//! Columns of printed scans.

use std::path::{Path, PathBuf};

use mrol::json::JsonPose;

/// A scan file's name, for a column.
pub(super) fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned()
}

/// Width of a column that holds the names of all `files`.
pub(super) fn name_width(files: &[PathBuf]) -> usize {
    files.iter().map(|file| name_of(file).chars().count()).max().unwrap_or(0).max("scan".len())
}

/// The translation of a pose, for a column: `   1.234   -0.010    2.000`.
pub(super) fn place(pose: &JsonPose) -> String {
    let [x, y, z] = pose.translation_m;
    format!("{x:>9.3} {y:>8.3} {z:>8.3}")
}

/// The head of the column of [`place`].
pub(super) const PLACE_HEAD: &str = "      x m      y m      z m";
