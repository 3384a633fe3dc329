//! Scans of E57 files.

use std::fs::File;
use std::io::Seek;
use std::path::Path;

use e57::{PointCloud, PointCloudReaderRaw, Record, RecordDataType, RecordName, RecordValue};
use nalgebra::Point3;

use super::e57_claims;
use super::e57_scan::E57Scan;
use super::error::SurveyError;
use crate::regular_file::open_regular;
use mrol_map::geometry::pose;

/// Most fields of a point.
const PROTOTYPE_RECORDS_MAX: usize = 256;
/// Most of them that are constant: they take no bytes in the file, and some in memory.
const CONSTANT_RECORDS_MAX: usize = 16;

/// An E57 file.
pub struct E57Reader {
    reader: e57::E57Reader<File>,
    clouds: Vec<PointCloud>,
}

impl E57Reader {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// When the file cannot be read or is no E57.
    pub fn open(path: &Path) -> Result<Self, SurveyError> {
        let (mut file, length) = open_regular(path)?;
        e57_claims::check(&mut file, length)?;
        file.rewind()?;
        let reader = e57::E57Reader::new(file)?;
        let clouds = reader.pointclouds();
        check_apart(&clouds)?;
        Ok(Self { reader, clouds })
    }

    /// The scans of the file.
    ///
    /// # Errors
    /// When a pose is none.
    pub fn scans(&self) -> Result<Vec<E57Scan>, SurveyError> {
        self.clouds.iter().enumerate().map(|(k, cloud)| scan_of(k, cloud)).collect()
    }

    /// The points of a scan, by its place among [`E57Reader::scans`].
    ///
    /// # Errors
    /// When there is no such scan, or it has neither Cartesian nor spherical coordinates.
    pub fn points(&mut self, scan: usize) -> Result<E57Points<'_>, SurveyError> {
        let cloud = self.clouds.get(scan).ok_or_else(|| content(format!("there is no scan {scan}")))?;
        let fields = Fields::of(&cloud.prototype)?;
        let prototype = cloud.prototype.clone();
        Ok(E57Points { raw: self.reader.pointcloud_raw(cloud)?, fields, prototype, skipped: 0 })
    }
}

/// Refuses scans that share their points, which would take any time to read.
fn check_apart(clouds: &[PointCloud]) -> Result<(), SurveyError> {
    let mut offsets: Vec<u64> = clouds.iter().map(|cloud| cloud.file_offset).collect();
    offsets.sort_unstable();
    match offsets.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(content(format!("two scans have the same points, at byte {}", pair[0]))),
        None => Ok(()),
    }
}

fn scan_of(k: usize, cloud: &PointCloud) -> Result<E57Scan, SurveyError> {
    let name = cloud.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| k.to_string());
    let survey_from_scan = cloud.transform.as_ref().map(|transform| {
        let (t, q) = (&transform.translation, &transform.rotation);
        pose([t.x, t.y, t.z], [q.x, q.y, q.z, q.w])
    });
    let survey_from_scan = survey_from_scan.transpose();
    let survey_from_scan =
        survey_from_scan.map_err(|error| content(format!("the pose of scan {name:?}: {error}")))?;
    Ok(E57Scan { name, points: cloud.records, survey_from_scan })
}

/// The points of a scan, read part by part.
pub struct E57Points<'a> {
    raw: PointCloudReaderRaw<'a, File>,
    fields: Fields,
    prototype: Vec<Record>,
    skipped: u64,
}

impl E57Points<'_> {
    /// The next points in the frame of the scan, meters, at most `points_max`; none after the last one. Those whose
    /// state says that they have no place, directions and invalid ones, are left out and counted.
    ///
    /// # Errors
    /// When the file ends before its last point, or is damaged.
    pub fn next_points(&mut self, points_max: usize) -> Result<Vec<Point3<f64>>, SurveyError> {
        let mut points = Vec::new();
        while points.len() < points_max
            && let Some(values) = self.raw.next()
        {
            match self.fields.point(&values?, &self.prototype)? {
                Some(point) => points.push(point),
                None => self.skipped += 1,
            }
        }
        Ok(points)
    }

    /// How many points had no place so far.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
}

/// Three coordinates among the fields of a point, and the field that says whether they hold.
#[derive(Debug, Clone, Copy)]
struct Triple {
    at: [usize; 3],
    state: Option<usize>,
}

/// Where the coordinates are among the fields of a point.
struct Fields {
    cartesian: Option<Triple>,
    /// Range, azimuth, elevation: meters and radians.
    spherical: Option<Triple>,
}

impl Fields {
    fn of(prototype: &[Record]) -> Result<Self, SurveyError> {
        if prototype.len() > PROTOTYPE_RECORDS_MAX {
            let count = prototype.len();
            return Err(content(format!("points of {count} fields, the limit is {PROTOTYPE_RECORDS_MAX}")));
        }
        // Of points that take no bytes a file could name any number.
        let takes_bits = |record: &Record| match record.data_type {
            RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
                min < max
            }
            RecordDataType::Single { .. } | RecordDataType::Double { .. } => true,
        };
        let constant = prototype.iter().filter(|record| !takes_bits(record)).count();
        if constant > CONSTANT_RECORDS_MAX {
            return Err(content(format!(
                "points of {constant} fields that are constant, the limit is {CONSTANT_RECORDS_MAX}"
            )));
        }
        if !prototype.iter().any(takes_bits) {
            return Err(content("points that take no bytes: every field is constant"));
        }
        let at = |name: &RecordName| prototype.iter().position(|record| record.name == *name);
        let triple = |names: [RecordName; 3], state: RecordName| {
            let [x, y, z] = names.each_ref().map(at);
            Some(Triple { at: [x?, y?, z?], state: at(&state) })
        };
        let cartesian = triple(
            [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ],
            RecordName::CartesianInvalidState,
        );
        let spherical = triple(
            [RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation],
            RecordName::SphericalInvalidState,
        );
        match cartesian.is_none() && spherical.is_none() {
            true => Err(content("points with neither Cartesian nor spherical coordinates")),
            false => Ok(Self { cartesian, spherical }),
        }
    }

    /// The place of a point; none of one that has none.
    fn point(
        &self,
        values: &[RecordValue],
        prototype: &[Record],
    ) -> Result<Option<Point3<f64>>, SurveyError> {
        if let Some(triple) = self.cartesian
            && let Some([x, y, z]) = triple.valid(values, prototype)?
        {
            return Ok(Some(Point3::new(x, y, z)));
        }
        let Some(triple) = self.spherical else { return Ok(None) };
        let valid = triple.valid(values, prototype)?;
        Ok(valid.map(|[range, azimuth, elevation]| {
            let level = range * elevation.cos();
            Point3::new(level * azimuth.cos(), level * azimuth.sin(), range * elevation.sin())
        }))
    }
}

impl Triple {
    /// The three numbers, where their state is 0 (valid) and all are finite.
    fn valid(self, values: &[RecordValue], prototype: &[Record]) -> Result<Option<[f64; 3]>, SurveyError> {
        let value = |at: usize| match (values.get(at), prototype.get(at)) {
            (Some(value), Some(record)) => Ok(value.to_f64(&record.data_type)?),
            _ => Err(content("a point lacks a field")),
        };
        if let Some(state) = self.state
            && value(state)? != 0.0
        {
            return Ok(None);
        }
        let [a, b, c] = self.at;
        let numbers = [value(a)?, value(b)?, value(c)?];
        Ok(Some(numbers).filter(|numbers| numbers.iter().all(|number| number.is_finite())))
    }
}

fn content(problem: impl Into<String>) -> SurveyError {
    SurveyError::Content(problem.into())
}
