//! Scans of 3DTK in the format `uos`: text in its axes, x right, y up, z ahead, centimeters.

use nalgebra::Point3;

use super::columns::Columns;
use super::coordinates::Coordinates;
use super::error::Problem;
use super::text;

/// Meters of a unit of these files.
const UNIT_M: f64 = 0.01;

/// The points of a `.3d` file, x ahead, y left, z up, meters. Columns behind the first three, as reflectance, are kept
/// out.
pub(super) fn points<C: Coordinates>(bytes: &[u8], named: Option<Columns>) -> Result<Vec<C>, Problem> {
    let points: Vec<Point3<f64>> = text::points(bytes, named)?;
    Ok(points.into_iter().map(|point| C::of_doubles(robot_from_uos(point.into()))).collect())
}

/// A place in the axes of 3DTK, left-handed and in centimeters, as one that is x ahead, y left, z up, in meters.
pub(in crate::scan) fn robot_from_uos([right, up, ahead]: [f64; 3]) -> [f64; 3] {
    // Not -right: 0 stays 0, which says that nothing returned.
    [ahead, 0.0 - right, up].map(|c| c * UNIT_M)
}
