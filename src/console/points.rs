//! The points of a file.

use std::path::Path;

use super::error::CliError;
use mrol_map::geometry::Point;
use mrol_map::scan::read_points;

/// Reads the points of a file, which must have at least one.
pub fn points_of(path: &Path) -> Result<Vec<Point>, CliError> {
    let points = read_points(path)?;
    if points.is_empty() {
        return Err(CliError::failed(format!("{}: no point in this file", path.display())));
    }
    Ok(points)
}
