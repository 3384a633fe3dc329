//! Scan files and folders of them.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::columns::Columns;
use super::coordinates::Coordinates;
use super::error::ReadError;
use super::format::{Format, extension};
use super::natural::compare_names;
use super::supported::{EXTENSIONS, FILE_BYTES_MAX};
use crate::geometry::Point;

/// The points of the scan file at `path`, in the sensor frame, meters.
///
/// The extension says the format, in either case: `.ply` (ascii, binary of either byte order), `.pcd` (ascii, binary,
/// binary_compressed), `.xyz` (text: the first three columns, or those that a line of names says, divided by spaces,
/// commas or semicolons; `#`, `//` or `%` starts a comment), `.npy` (an array of shape (..., 3), or with columns behind
/// x y z), `.bin` (little-endian float32 x y z i), `.f32` (x y z), `.3d` (text of 3DTK, whose axes and centimeters
/// become x ahead, y left, z up, meters). Points that are not finite are kept: they mean "no return". Coordinates are
/// rounded to f32, see [`read_exact_points`].
///
/// # Errors
/// When the file cannot be read, is larger than a scan may be, is of another format, or is broken or truncated; the
/// error names the file and the line, byte or element. Bare floats that look like rows of another length are refused
/// too, naming the [`Columns`] that they seem to have.
pub fn read_points(path: &Path) -> Result<Vec<Point>, ReadError> {
    read(path, None)
}

/// The points of [`read_points`] in double precision, as files in survey coordinates have them.
///
/// # Errors
/// Those of [`read_points`].
pub fn read_exact_points(path: &Path) -> Result<Vec<Point3<f64>>, ReadError> {
    read(path, None)
}

/// [`read_exact_points`] of a text, an array or bare floats whose columns somebody named.
///
/// # Errors
/// Those of [`read_points`], and columns for a file whose header names its own.
pub fn read_exact_points_by(path: &Path, columns: Option<Columns>) -> Result<Vec<Point3<f64>>, ReadError> {
    read(path, columns)
}

fn read<C: Coordinates>(path: &Path, columns: Option<Columns>) -> Result<Vec<C>, ReadError> {
    let format = Format::named_by(path)?;
    // Whoever opens a named pipe waits for its writer.
    check_regular(path, &fs::metadata(path).map_err(ReadError::io(path))?)?;
    let bytes = read_file(path)?;
    format.points(&bytes, columns).map_err(|problem| problem.in_file(path))
}

/// The points in the `bytes` of a scan file; `path` gives the format by its extension, and errors name it.
///
/// # Errors
/// When the bytes are of another format, broken or truncated.
pub fn parse_points(path: &Path, bytes: &[u8]) -> Result<Vec<Point>, ReadError> {
    Format::named_by(path)?.points(bytes, None).map_err(|problem| problem.in_file(path))
}

/// The scan files that `paths` name: a directory gives its scan files in the natural order of
/// their names (scan2 before scan10), a file itself.
///
/// # Errors
/// When a path does not exist, a file has an extension that [`read_points`] does not know or is none (a named pipe), a
/// directory cannot be read, or a directory has no scan file.
pub fn scan_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, ReadError> {
    scan_files_of(paths, &EXTENSIONS)
}

/// [`scan_files`] whose formats are those of `extensions`, each with its dot, in lower case.
///
/// # Errors
/// As [`scan_files`], for these extensions.
pub fn scan_files_of(
    paths: &[PathBuf],
    extensions: &'static [&'static str],
) -> Result<Vec<PathBuf>, ReadError> {
    let mut files = Vec::new();
    for path in paths {
        let metadata = fs::metadata(path).map_err(ReadError::io(path))?;
        if metadata.is_dir() {
            files.extend(files_of_directory(path, extensions)?);
        } else {
            check_extension(path, extensions)?;
            check_regular(path, &metadata)?;
            files.push(path.clone());
        }
    }
    Ok(files)
}

/// Refuses a file with another extension than those.
fn check_extension(path: &Path, extensions: &'static [&'static str]) -> Result<(), ReadError> {
    let extension = extension(path);
    match extensions.iter().any(|known| known[1..] == extension) {
        true => Ok(()),
        false => Err(ReadError::Extension { path: path.to_owned(), extension, supported: extensions }),
    }
}

fn files_of_directory(
    directory: &Path,
    extensions: &'static [&'static str],
) -> Result<Vec<PathBuf>, ReadError> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).map_err(ReadError::io(directory))? {
        let path = entry.map_err(ReadError::io(directory))?.path();
        if check_extension(&path, extensions).is_ok() && path.is_file() {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(ReadError::Empty { path: directory.to_owned(), supported: extensions });
    }
    files.sort_by(|a, b| compare_names(a, b));
    Ok(files)
}

/// Refuses what may have no end.
fn check_regular(path: &Path, metadata: &fs::Metadata) -> Result<(), ReadError> {
    match what_else(metadata.file_type()) {
        Some(what) => Err(ReadError::NotAFile { path: path.to_owned(), what }),
        None => Ok(()),
    }
}

/// What is there in the place of a regular file.
#[cfg(unix)]
fn what_else(there: fs::FileType) -> Option<&'static str> {
    use std::os::unix::fs::FileTypeExt;
    match there {
        it if it.is_file() => None,
        it if it.is_dir() => Some("a folder"),
        it if it.is_fifo() => Some("a named pipe"),
        it if it.is_socket() => Some("a socket"),
        _ => Some("a device"),
    }
}

/// What is there in the place of a regular file.
#[cfg(not(unix))]
fn what_else(there: fs::FileType) -> Option<&'static str> {
    match there {
        it if it.is_file() => None,
        it if it.is_dir() => Some("a folder"),
        _ => Some("no file"),
    }
}

/// The content of the file at `path`, at most [`FILE_BYTES_MAX`] whatever its metadata says.
pub(in crate::scan) fn read_file(path: &Path) -> Result<Vec<u8>, ReadError> {
    let too_large = || ReadError::TooLarge { path: path.to_owned() };
    let file = File::open(path).map_err(ReadError::io(path))?;
    let length = file.metadata().map_err(ReadError::io(path))?.len();
    if length > FILE_BYTES_MAX {
        return Err(too_large());
    }
    let mut bytes = Vec::with_capacity(length as usize + 1);
    file.take(FILE_BYTES_MAX + 1).read_to_end(&mut bytes).map_err(ReadError::io(path))?;
    if bytes.len() as u64 > FILE_BYTES_MAX { Err(too_large()) } else { Ok(bytes) }
}
