//! Points of LAS and LAZ files.

use std::io::{BufReader, Seek};
use std::path::Path;

use las::{PointData, Reader};
use nalgebra::Point3;

use super::error::SurveyError;
use super::las_claims;
use crate::regular_file::open_regular;

/// Points that are read at once.
const POINTS_AT_ONCE: u64 = 1 << 16;

/// A LAS or LAZ file that is read part by part.
pub struct LasReader {
    reader: Reader,
    part: PointData,
}

impl LasReader {
    /// Opens the file at `path`, whose claims are checked against its length.
    ///
    /// # Errors
    /// When the file cannot be read, is no LAS, claims more than it has, or names another unit than meters.
    pub fn open(path: &Path) -> Result<Self, SurveyError> {
        let (file, length) = open_regular(path)?;
        let mut file = BufReader::new(file);
        las_claims::check(&mut file, length)?;
        file.rewind()?;
        let mut reader = Reader::new(file)?;
        let part = reader.read_points(0)?;
        Ok(Self { reader, part })
    }

    /// Points that the header names.
    pub fn points(&self) -> u64 {
        self.reader.header().number_of_points()
    }

    /// The next points in the coordinates of the survey, meters; none after the last one.
    ///
    /// # Errors
    /// When the file ends before its last point, or is damaged.
    pub fn next_points(&mut self) -> Result<Vec<Point3<f64>>, SurveyError> {
        if self.reader.fill_points(POINTS_AT_ONCE, &mut self.part)? == 0 {
            return Ok(Vec::new());
        }
        let part = &self.part;
        Ok(part.x().zip(part.y()).zip(part.z()).map(|((x, y), z)| Point3::new(x, y, z)).collect())
    }
}
