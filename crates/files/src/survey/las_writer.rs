//! Points written as LAS or LAZ.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use las::point::Format;
use las::{Builder, Point, Transform, Vector, Version, Writer};

use super::error::SurveyError;
use super::failing_late::{FailingLate, Failure};
use super::las_kind::LasKind;

/// Steps of coordinates in a file, the finest first, meters.
const SCALES_M: [f64; 4] = [1e-4, 1e-3, 1e-2, 1e-1];

/// Writes points of the map frame, meters, as LAS 1.2, points of format 0, in the coordinates of the survey.
///
/// The origin is the offset of the file, and is added in double precision. `extent_m` is the largest absolute
/// coordinate of the points. Coordinates have steps of 0.1 mm up to an extent of 214 km, and ten times as much for ten
/// times the extent.
///
/// # Errors
/// When the file cannot be written, or there are more points, or wider ones, than the format holds.
pub fn write_las(
    path: &Path,
    kind: LasKind,
    origin_m: [f64; 3],
    extent_m: f64,
    points: impl ExactSizeIterator<Item = [f64; 3]>,
) -> Result<(), SurveyError> {
    if u32::try_from(points.len()).is_err() {
        let message =
            format!("{} points, the limit of LAS 1.2 is {}: take a coarser --level", points.len(), u32::MAX);
        return Err(SurveyError::Writing(message));
    }
    let holds = |scale: &f64| extent_m / scale < f64::from(i32::MAX);
    let scale = SCALES_M.into_iter().find(holds).ok_or_else(|| {
        SurveyError::Writing(format!(
            "points {extent_m} m from the origin: LAS does not hold coordinates that wide"
        ))
    })?;
    let mut builder = Builder::default();
    builder.version = Version::new(1, 2);
    builder.point_format = Format::new(0)?;
    builder.point_format.is_compressed = kind == LasKind::Laz;
    builder.generating_software = "mrol".to_owned();
    let axis = |k: usize| Transform { scale, offset: origin_m[k] };
    builder.transforms = Vector { x: axis(0), y: axis(1), z: axis(2) };
    let failure = Failure::default();
    let file = FailingLate::new(BufWriter::new(File::create(path)?), failure.clone());
    let mut writer = Writer::new(file, builder.into_header()?)?;
    for [x, y, z] in points {
        let [x, y, z] = [x + origin_m[0], y + origin_m[1], z + origin_m[2]];
        writer.write_point(Point { x, y, z, return_number: 1, number_of_returns: 1, ..Point::default() })?;
        failure.check()?;
    }
    // The header is written last, and the buffer is written where it goes back to the start.
    writer.into_inner()?;
    Ok(failure.check()?)
}
