//! Points that commands ask a server about: of a file or of the command line, in the map's coordinates or in those of a
//! survey.

use std::path::Path;

use nalgebra::Point3;

use super::scan_file_options::ScanFileOptions;
use mrol::console::{CliError, OriginChoice, ScanReader, Survey, parse};
use mrol_client::Client;
use mrol_map::geometry::Point;
use mrol_map::map::{MapName, MapOrigin, MapSettings};

#[derive(Debug, clap::Args)]
pub(super) struct SurveyOptions {
    /// Where the map's origin lies in the coordinates of the points: "x y z", or auto for that of the map. It is
    /// subtracted from them, and answers are in the map's coordinates [default: they are the map's]
    #[arg(long, value_name = "ORIGIN", allow_hyphen_values = true, value_parser = parse::origin)]
    origin: Option<OriginChoice>,
    #[command(flatten)]
    scan_files: ScanFileOptions,
}

impl SurveyOptions {
    /// How points like those of `first` lie to a map of these settings.
    ///
    /// # Errors
    /// The map has another origin, or none where that of the map is asked for.
    pub(super) fn survey(
        &self,
        settings: &MapSettings,
        first: &[Point3<f64>],
        has_poses: bool,
    ) -> Result<Survey, CliError> {
        let origin = match (self.origin, settings.origin) {
            (None, _) => None,
            (Some(OriginChoice::Auto), of_map @ Some(_)) => of_map,
            (Some(OriginChoice::Auto), None) => {
                return Err(CliError::usage("--origin auto: the map has no origin"));
            }
            (Some(OriginChoice::At(position_m)), of_map) => {
                let given = MapOrigin::new(position_m).map_err(CliError::usage)?;
                if of_map != Some(given) {
                    let of_map =
                        of_map.map_or("none".to_owned(), |of_map| format!("{:?}", of_map.position_m));
                    return Err(CliError::usage(format!(
                        "--origin: that of the map is {of_map}, not {position_m:?}; --origin auto takes that of the map"
                    )));
                }
                Some(given)
            }
        };
        Ok(Survey::of(first, origin, has_poses, settings.resolution_m).with_reader(self.reader()))
    }

    /// How files of points are read.
    pub(super) fn reader(&self) -> ScanReader {
        self.scan_files.reader()
    }

    /// The points of a file, in f64.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn read(&self, file: &Path) -> Result<Vec<Point3<f64>>, CliError> {
        self.reader().read(file)
    }

    /// The points of a file or, without one, those given, in f64, with how they lie to the map.
    ///
    /// # Errors
    /// The file cannot be read or has no point; the origin is not the map's.
    pub(super) async fn exact(
        &self,
        client: &Client,
        map: &MapName,
        file: Option<&Path>,
        given: &[[f64; 3]],
        has_poses: bool,
    ) -> Result<(Vec<Point3<f64>>, Survey), CliError> {
        let points = match file {
            Some(file) => self.read(file)?,
            None => given.iter().map(|&place| Point3::from(place)).collect(),
        };
        if let Some(file) = file.filter(|_| points.is_empty()) {
            return Err(CliError::failed(format!("{}: no point in this file", file.display())));
        }
        let settings = client.map_info(map).await?.settings;
        let survey = self.survey(&settings, &points, has_poses)?;
        Ok((points, survey))
    }

    /// The points of a file or, without one, those given, in the map's coordinates.
    ///
    /// # Errors
    /// As [`Self::exact`], and where f32 holds the points too coarsely for the map's voxels.
    pub(super) async fn points(
        &self,
        client: &Client,
        map: &MapName,
        file: Option<&Path>,
        given: &[[f64; 3]],
    ) -> Result<Vec<Point>, CliError> {
        let (points, survey) = self.exact(client, map, file, given, false).await?;
        survey.near(&named(file), &points)
    }
}

/// How messages name points.
pub(super) fn named(file: Option<&Path>) -> String {
    file.map_or_else(|| "--point".to_owned(), |file| file.display().to_string())
}
