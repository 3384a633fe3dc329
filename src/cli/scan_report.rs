//! How scans are printed.

use std::path::{Path, PathBuf};

use crate::geometry::{Pose, rotation_xyzw, translation_m};

/// A scan file's name, for a column.
pub(super) fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned()
}

/// Width of a column that holds the names of all `files`.
pub(super) fn name_width(files: &[PathBuf]) -> usize {
    files.iter().map(|file| name_of(file).chars().count()).max().unwrap_or(0).max("scan".len())
}

/// A pose as x y z (meters) qx qy qz qw.
pub(super) fn seven(pose: &Pose) -> [f64; 7] {
    let ([x, y, z], [qx, qy, qz, qw]) = (translation_m(pose), rotation_xyzw(pose));
    [x, y, z, qx, qy, qz, qw]
}

/// The translation of a pose, for a column: `   1.234   -0.010    2.000`.
pub(super) fn place(pose: &[f64; 7]) -> String {
    format!("{:>9.3} {:>8.3} {:>8.3}", pose[0], pose[1], pose[2])
}

/// The head of the column of [`place`].
pub(super) const PLACE_HEAD: &str = "      x m      y m      z m";
