//! Columns of printed scans, and the order in which their files are read.

use std::path::{Path, PathBuf};

use mrol::console::{CliError, Output, count};
use mrol::json::JsonPose;
use mrol_map::scan::compare_names;

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

/// Says how many files are read, the first and the last of them; and where files that were named one by one, as a
/// shell's pattern names them, are not in the natural order, that they are taken as given.
pub(super) fn tell_order(files: &[PathBuf], output: &Output) -> Result<(), CliError> {
    if let Some([a, b]) = files.windows(2).find(|pair| is_out_of_order(&pair[0], &pair[1])) {
        output.note(format!(
            "the files are taken in the order in which they are given, {} before {}; a folder is read in the natural order",
            name_of(a),
            name_of(b)
        ));
    }
    match files {
        [] => Ok(()),
        [file] => output.say(format!("1 scan: {}", name_of(file))),
        [first, .., last] => {
            let number = count(files.len());
            output.say(format!("{number} scans, from {} to {}", name_of(first), name_of(last)))
        }
    }
}

/// True of two files of one folder of which the second comes first in the natural order.
fn is_out_of_order(a: &Path, b: &Path) -> bool {
    a.parent() == b.parent() && compare_names(a, b).is_gt()
}
