//! Maps of point clouds: every scan file that a map reads, in the map frame or the coordinates of a survey.

use nalgebra::{Point3, Vector3};

use super::command::Import;
use super::imported::Imported;
use mrol::console::{CliError, Output, Survey, count};
use mrol_files::MappedPoints;
use mrol_map::geometry::Point;
use mrol_map::scan::{PointFilter, read_exact_points_by};

/// The map of a point cloud. Points that are not finite, or at exactly 0 0 0, are left out and told.
///
/// # Errors
/// When the file cannot be read, or f32 holds its points too coarsely.
pub(super) fn read(import: &Import, output: &Output) -> Result<Imported, CliError> {
    let file = import.file.as_path();
    let resolution_m = import.resolution_of_points()?;
    import.settings(resolution_m, None)?;
    let mut points = read_exact_points_by(file, import.columns)?;
    let all = points.len();
    points.retain(|point| is_return(point));
    if points.len() < all {
        let left_out = count(all - points.len());
        output.note(format!("{left_out} points are left out: not finite, or at exactly 0 0 0"));
    }
    let origin = import.origin.map(|choice| choice.origin(file, &points)).transpose()?;
    let settings = import.settings(resolution_m, origin)?;
    let near = Survey::of(&points, origin, false, resolution_m).near(&file.display().to_string(), &points)?;
    let mut mapped = MappedPoints::new(settings).map_err(CliError::usage)?;
    mapped.add(&near);
    if mapped.beyond() > 0 {
        output.note(format!("{} points are left out: beyond the map's range", count(mapped.beyond())));
    }
    Ok(Imported { settings, contents: mapped.into_contents() })
}

/// True of a point that drivers do not write for "nothing returned".
fn is_return(point: &Point3<f64>) -> bool {
    point.coords != Vector3::zeros() && PointFilter::default().is_return(Point::from(*point))
}
