//! What a program has in the place of surveys that was built without the feature `surveys`: a word on what is lacking.

use std::path::Path;

use nalgebra::Point3;

use super::e57_scan::E57Scan;
use super::error::SurveyError;
use super::las_kind::LasKind;
use crate::file_kind::FileKind;

/// A LAS or LAZ file, which this program does not read.
pub enum LasReader {}

/// An E57 file, which this program does not read.
pub enum E57Reader {}

/// The points of a scan, which this program does not read.
pub enum E57Points {}

impl LasReader {
    /// Says what is lacking.
    ///
    /// # Errors
    /// Always.
    pub fn open(_path: &Path) -> Result<Self, SurveyError> {
        Err(lacking(FileKind::Las))
    }

    /// Points that the header names.
    pub fn points(&self) -> u64 {
        match *self {}
    }

    /// The next points.
    ///
    /// # Errors
    /// Never: there is no such file.
    pub fn next_points(&mut self) -> Result<Vec<Point3<f64>>, SurveyError> {
        match *self {}
    }
}

impl E57Reader {
    /// Says what is lacking.
    ///
    /// # Errors
    /// Always.
    pub fn open(_path: &Path) -> Result<Self, SurveyError> {
        Err(lacking(FileKind::E57))
    }

    /// The scans of the file.
    ///
    /// # Errors
    /// Never: there is no such file.
    pub fn scans(&self) -> Result<Vec<E57Scan>, SurveyError> {
        match *self {}
    }

    /// The points of a scan.
    ///
    /// # Errors
    /// Never: there is no such file.
    pub fn points(&mut self, _scan: usize) -> Result<E57Points, SurveyError> {
        match *self {}
    }
}

impl E57Points {
    /// The next points.
    ///
    /// # Errors
    /// Never: there is no such file.
    pub fn next_points(&mut self, _points_max: usize) -> Result<Vec<Point3<f64>>, SurveyError> {
        match *self {}
    }

    /// How many points had no place so far.
    pub fn skipped(&self) -> u64 {
        match *self {}
    }
}

/// Says what is lacking.
///
/// # Errors
/// Always.
pub fn write_las(
    _path: &Path,
    _kind: LasKind,
    _origin_m: [f64; 3],
    _extent_m: f64,
    _points: impl ExactSizeIterator<Item = [f64; 3]>,
) -> Result<(), SurveyError> {
    Err(lacking(FileKind::Las))
}

/// Says what is lacking.
///
/// # Errors
/// Always.
pub fn write_e57(
    _path: &Path,
    _guid: &str,
    _points: impl Iterator<Item = [f64; 3]>,
) -> Result<(), SurveyError> {
    Err(lacking(FileKind::E57))
}

fn lacking(kind: FileKind) -> SurveyError {
    match kind.checked() {
        Err(lacking) => lacking.into(),
        Ok(kind) => SurveyError::Content(format!(".{} files are not read", kind.extension())),
    }
}
