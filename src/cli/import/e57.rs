//! Maps of E57: scans at their poses, or points alone.

use nalgebra::{Point3, Translation3, Vector3};
use uuid::Uuid;

use super::cloud::PointMap;
use super::imported::{Imported, in_file};
use super::options::ImportOptions;
use mrol::console::{CliError, Output, Survey, count};
use mrol::offline::Mapper;
use mrol_files::survey::{E57Reader, E57Scan};
use mrol_map::align::AlignmentSettings;
use mrol_map::geometry::{Point, Pose};
use mrol_map::mapping::Guess;
use mrol_map::scan::PointFilter;
use mrol_store::Snapshot;

/// Most points of a scan of the map: a scan of more goes in as several, taken at the same place.
const SCAN_POINTS_MAX: usize = 10_000_000;
/// Points without a pose that are read at once.
const POINTS_AT_ONCE: usize = 1 << 16;

/// The map of the scans of a file. Where each has a pose, they are scans of the map at these poses, and what they saw
/// through is free; otherwise, or if that is asked for, all are points.
///
/// # Errors
/// When the file cannot be read, or f32 holds its points too coarsely.
pub(super) fn read(import: &ImportOptions, output: &Output) -> Result<Imported, CliError> {
    let file = import.file.as_path();
    let reader = E57Reader::open(file).map_err(in_file(file))?;
    let scans = reader.scans().map_err(in_file(file))?;
    let named: u64 = scans.iter().map(|scan| scan.points).sum();
    let output = output.clone().with_bar_of(named as usize, "points");
    let mut import = E57Import { import, reader, output, read: 0, skipped: 0 };
    let poses: Option<Vec<Pose>> = scans.iter().map(|scan| scan.survey_from_scan).collect();
    let imported = match poses.filter(|_| !import.import.as_points) {
        Some(poses) => import.at_poses(&scans, &poses),
        None => import.as_points(&scans),
    }?;
    let output = import.output;
    output.clear_bar();
    if import.skipped > 0 {
        output.note(format!(
            "{} points are left out: their state says that they have no place",
            count(import.skipped as usize)
        ));
    }
    Ok(imported)
}

struct E57Import<'a> {
    import: &'a ImportOptions,
    reader: E57Reader,
    output: Output,
    /// Points so far.
    read: u64,
    /// Those of them that have no place.
    skipped: u64,
}

impl E57Import<'_> {
    /// The map of points in the coordinates of the survey.
    fn as_points(&mut self, scans: &[E57Scan]) -> Result<Imported, CliError> {
        if let Some(scan) = scans.iter().find(|scan| scan.survey_from_scan.is_none()) {
            self.output.note(format!(
                "scan {:?} has no pose: all scans are taken as points, and nothing is known of free space",
                scan.name
            ));
        }
        let output = self.output.clone();
        let mut map = PointMap::new(self.import, &output)?;
        for (k, scan) in scans.iter().enumerate() {
            let pose = scan.survey_from_scan.unwrap_or_else(Pose::identity);
            self.parts(k, POINTS_AT_ONCE, |points| {
                let in_survey: Vec<Point3<f64>> = points.iter().map(|point| pose * point).collect();
                map.add(&in_survey)
            })?;
        }
        Ok(map.finish())
    }

    /// The map of scans at their poses.
    fn at_poses(&mut self, scans: &[E57Scan], poses: &[Pose]) -> Result<Imported, CliError> {
        let resolution_m = self.import.resolution_of_points()?;
        self.import.settings(resolution_m, None)?;
        let file = self.import.file.as_path();
        let (import, output) = (self.import, self.output.clone());
        let filter = PointFilter::default();
        let mut mapping: Option<SurveyMapper> = None;
        let mut parts = 0;
        for (k, (scan, pose)) in scans.iter().zip(poses).enumerate() {
            let name = format!("{}: scan {:?}", file.display(), scan.name);
            self.parts(k, SCAN_POINTS_MAX, |mut points| {
                points.retain(|point| filter.is_return(Point::from(*point)));
                let Some(first) = points.first() else { return Ok(()) };
                // Points that f32 holds too coarsely are too far from the sensor to be those of a scan at its pose.
                let of_scan = Survey::of(&points, None, false, resolution_m);
                if parts == 0 {
                    of_scan.note_unit(file, &points, &output);
                }
                let local = of_scan.near(&name, &points).map_err(|_| {
                    CliError::failed(format!(
                        "{name}: its points are too far from its pose for f32: they seem to be in the coordinates of the \
                         survey; --as-points takes all scans as points, without what they saw through"
                    ))
                })?;
                let in_survey = [pose * first];
                let SurveyMapper { mapper, survey, origin_m } = match &mut mapping {
                    Some(mapping) => mapping,
                    none => none.insert(SurveyMapper::of(import, &in_survey, resolution_m)?),
                };
                survey.near(&name, &in_survey)?;
                let map_from_scan = Translation3::from(-*origin_m) * pose;
                let mapped = mapper.add(parts, &local, Some(map_from_scan));
                let mapped = mapped.map_err(|error| CliError::failed(format!("{name}: {error}")))?;
                if mapped.beyond_map > 0 {
                    let beyond = count(mapped.beyond_map);
                    output.note(format!("{name}: {beyond} points are left out: beyond the map's range"));
                }
                parts += 1;
                Ok(())
            })?;
        }
        match mapping {
            Some(SurveyMapper { mapper, .. }) => {
                let Snapshot { settings, contents, .. } = Snapshot::of(mapper.map(), Uuid::new_v4());
                Ok(Imported { settings, contents })
            }
            None => Ok(Imported {
                settings: self.import.settings(resolution_m, None)?,
                contents: Default::default(),
            }),
        }
    }

    /// Gives the points of a scan to `each`, at most `points_max` at once.
    fn parts(
        &mut self,
        scan: usize,
        points_max: usize,
        mut each: impl FnMut(Vec<Point3<f64>>) -> Result<(), CliError>,
    ) -> Result<(), CliError> {
        let file = self.import.file.as_path();
        let mut reader = self.reader.points(scan).map_err(in_file(file))?;
        loop {
            let points = reader.next_points(points_max).map_err(in_file(file))?;
            if points.is_empty() {
                break;
            }
            self.read += points.len() as u64;
            self.output.advance_to(self.read);
            each(points)?;
        }
        self.skipped += reader.skipped();
        Ok(())
    }
}

/// A map that grows scan by scan, at poses of a survey.
struct SurveyMapper {
    mapper: Mapper,
    survey: Survey,
    /// The map's origin in the survey.
    origin_m: Vector3<f64>,
}

impl SurveyMapper {
    /// An empty map, where the first points of the survey are `first`.
    fn of(import: &ImportOptions, first: &[Point3<f64>], resolution_m: f64) -> Result<Self, CliError> {
        let origin = import.origin.map(|choice| choice.origin(&import.file, first)).transpose()?;
        let settings = import.settings(resolution_m, origin)?;
        Ok(Self {
            mapper: Mapper::new(settings, AlignmentSettings::default(), Guess::Last)?,
            survey: Survey::of(first, origin, false, resolution_m),
            origin_m: origin.map(|origin| Vector3::from(origin.position_m)).unwrap_or_default(),
        })
    }
}
