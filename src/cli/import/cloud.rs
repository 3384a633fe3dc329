//! Maps of points: every scan file that a map reads, in the map frame or the coordinates of a survey.

use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::imported::Imported;
use super::options::ImportOptions;
use mrol::console::{CliError, Output, Survey, count};
use mrol_files::MappedPoints;
use mrol_map::geometry::Point;
use mrol_map::map::MapSettings;
use mrol_map::scan::{PointFilter, read_exact_points_by};

/// The map of a point cloud. Points that are not finite, or at exactly 0 0 0, are left out and told.
///
/// # Errors
/// When the file cannot be read, or f32 holds its points too coarsely.
pub(super) fn read(import: &ImportOptions, output: &Output) -> Result<Imported, CliError> {
    let mut map = PointMap::new(import, output)?;
    map.add(&read_exact_points_by(&import.file, import.columns)?)?;
    Ok(map.finish())
}

/// A map of points that come part by part, in the coordinates of a file.
pub(super) struct PointMap<'a> {
    import: &'a ImportOptions,
    output: &'a Output,
    resolution_m: f64,
    /// None until the first point that counts, near which the origin may lie.
    begun: Option<Begun>,
    /// Points that are not finite, or at exactly 0 0 0.
    no_returns: usize,
}

struct Begun {
    settings: MapSettings,
    survey: Survey,
    points: MappedPoints,
}

impl<'a> PointMap<'a> {
    /// A map without points.
    ///
    /// # Errors
    /// When the resolution is not given, or a setting is out of range.
    pub(super) fn new(import: &'a ImportOptions, output: &'a Output) -> Result<Self, CliError> {
        let resolution_m = import.resolution_of_points()?;
        import.settings(resolution_m, None)?;
        Ok(Self { import, output, resolution_m, begun: None, no_returns: 0 })
    }

    /// Adds points of the file, meters.
    ///
    /// # Errors
    /// When f32 holds them too coarsely, once the origin was subtracted.
    pub(super) fn add(&mut self, points: &[Point3<f64>]) -> Result<(), CliError> {
        let returns: Vec<Point3<f64>> = points.iter().copied().filter(is_return).collect();
        self.no_returns += points.len() - returns.len();
        if returns.is_empty() {
            return Ok(());
        }
        let file = self.import.file.as_path();
        let begun = match &mut self.begun {
            Some(begun) => begun,
            none => {
                let begun = Begun::of(self.import, self.resolution_m, file, &returns)?;
                begun.survey.note_unit(file, &returns, self.output);
                none.insert(begun)
            }
        };
        begun.points.add(&begun.survey.near(&file.display().to_string(), &returns)?);
        Ok(())
    }

    /// The map, once the points that were left out were told.
    pub(super) fn finish(self) -> Imported {
        let output = self.output;
        if self.no_returns > 0 {
            let left_out = count(self.no_returns);
            output.note(format!("{left_out} points are left out: not finite, or at exactly 0 0 0"));
        }
        let Some(Begun { settings, points, .. }) = self.begun else {
            let settings = MapSettings::new(self.resolution_m, self.import.levels);
            return Imported { settings, contents: Default::default() };
        };
        if points.beyond() > 0 {
            let beyond = count(points.beyond());
            output.note(format!(
                "{beyond} points are left out: beyond the range of a map, 1,048,576 voxels each way"
            ));
        }
        Imported { settings, contents: points.into_contents() }
    }
}

impl Begun {
    fn of(
        import: &ImportOptions,
        resolution_m: f64,
        file: &Path,
        first: &[Point3<f64>],
    ) -> Result<Self, CliError> {
        let origin = import.origin.map(|choice| choice.origin(file, first)).transpose()?;
        let settings = import.settings(resolution_m, origin)?;
        let survey = Survey::of(first, origin, false, resolution_m);
        Ok(Self { settings, survey, points: MappedPoints::new(settings).map_err(CliError::usage)? })
    }
}

/// True of a point that drivers do not write for "nothing returned".
fn is_return(point: &Point3<f64>) -> bool {
    point.coords != Vector3::zeros() && PointFilter::default().is_return(Point::from(*point))
}
