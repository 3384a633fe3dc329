//! Reading of scan files, by what they say and by what somebody says of them.

use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::error::CliError;
use mrol_files::DepthImages;
use mrol_map::scan::{Columns, ReadError, read_exact_points_by, scan_files, scan_files_of};

/// The extension of depth images.
const DEPTH_IMAGES: [&str; 1] = [".png"];

/// How scan files are read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ScanReader {
    /// By what they say.
    #[default]
    AsTheySay,
    /// As rows of numbers in these columns.
    Rows(Columns),
    /// As depth images.
    Depths(DepthImages),
}

impl ScanReader {
    /// The scan files that `paths` name: a folder gives those that this reads, in the natural order of their names.
    ///
    /// # Errors
    /// When a path does not exist or is of another format, or a folder has no scan file.
    pub fn files(&self, paths: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
        match self {
            Self::Depths(_) => Ok(scan_files_of(paths, &DEPTH_IMAGES)?),
            Self::AsTheySay | Self::Rows(_) => scan_files(paths).map_err(|error| match are_images(&error) {
                true => CliError::usage(format!(
                    "{error}; depth images (.png) are read with --camera \"fx fy cx cy\""
                )),
                false => error.into(),
            }),
        }
    }

    /// The points of a file in its scanner's frame, meters, in double precision.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(&self, file: &Path) -> Result<Vec<Point3<f64>>, CliError> {
        match self {
            Self::AsTheySay => Ok(read_exact_points_by(file, None)?),
            Self::Rows(columns) => Ok(read_exact_points_by(file, Some(*columns))?),
            Self::Depths(images) => {
                images.read(file).map_err(|error| CliError::failed(format!("{}: {error}", file.display())))
            }
        }
    }
}

impl From<Option<Columns>> for ScanReader {
    fn from(columns: Option<Columns>) -> Self {
        columns.map_or(Self::AsTheySay, Self::Rows)
    }
}

/// True where images were given that nobody said the camera of.
fn are_images(error: &ReadError) -> bool {
    match error {
        ReadError::Extension { extension, .. } => extension == "png",
        ReadError::Empty { path, .. } => scan_files_of(std::slice::from_ref(path), &DEPTH_IMAGES).is_ok(),
        _ => false,
    }
}
