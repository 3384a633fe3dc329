//! Surveys: scans whose coordinates are too large for points of f32, as those of national grids.

use std::path::Path;

use nalgebra::{Point3, Translation3, Vector3};

use super::error::CliError;
use super::output::Output;
use super::scan_reader::ScanReader;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MapOrigin;
use mrol_map::scan::{PointFilter, UnitDoubt};

/// Coordinates are too coarse where rounding them to f32 moves a point by more than this share of a voxel.
const ROUNDING_SHARE: f64 = 1.0 / 16.0;

/// What a caller wants for the origin of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OriginChoice {
    /// The first point of the first scan, in whole meters.
    Auto,
    /// This position of the survey, meters.
    At([f64; 3]),
}

impl OriginChoice {
    /// The origin, where the points of the first file are `first`.
    ///
    /// # Errors
    /// Names a file without a finite point.
    pub fn origin(self, file: &Path, first: &[Point3<f64>]) -> Result<MapOrigin, CliError> {
        let position_m = match self {
            Self::At(position_m) => position_m,
            Self::Auto => first_place(first).ok_or_else(|| {
                CliError::failed(format!("{}: no finite point, which --origin auto needs", file.display()))
            })?,
        };
        MapOrigin::new(position_m).map_err(CliError::usage)
    }
}

/// The first finite point that is not 0 0 0, in whole meters.
fn first_place(points: &[Point3<f64>]) -> Option<[f64; 3]> {
    let is_place =
        |point: &&Point3<f64>| point.coords.iter().all(|c| c.is_finite()) && point.coords != Vector3::zeros();
    points.iter().find(is_place).map(|point| point.coords.map(f64::round).into())
}

/// How scans in the coordinates of a survey become scans of points near 0 and poses in the map, exactly: points are
/// shifted, and poses composed, in f64.
///
/// With an origin O the map has the place `P p - O` for a point `p` of a file and its pose `P`, which is the identity
/// where nobody knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// The map's origin in the frame of the poses.
    origin: Vector3<f64>,
    /// What is subtracted from the points of every file, and put into their poses.
    shift: Vector3<f64>,
    resolution_m: f64,
    /// How files are read.
    reader: ScanReader,
}

impl Survey {
    /// The survey whose first scan has the points `first`, for a map of voxels of `resolution_m`.
    pub fn of(first: &[Point3<f64>], origin: Option<MapOrigin>, has_poses: bool, resolution_m: f64) -> Self {
        let origin = origin.map(|origin| Vector3::from(origin.position_m));
        let near = origin.or_else(|| first_place(first).map(Vector3::from));
        let shift = match has_poses {
            // Poses may be those of sensors in the survey, or bring points of the survey near 0.
            true => near.filter(|_| is_coarse(first, &Vector3::zeros(), resolution_m)),
            false => origin,
        };
        Self {
            origin: origin.unwrap_or_default(),
            shift: shift.unwrap_or_default(),
            resolution_m,
            reader: ScanReader::default(),
        }
    }

    /// The survey of files that are read so.
    #[must_use]
    pub fn with_reader(self, reader: ScanReader) -> Self {
        Self { reader, ..self }
    }

    /// Notes that the points of the first file do not seem to be in meters, if that is so.
    pub fn note_unit(&self, file: &Path, first: &[Point3<f64>], output: &Output) {
        // Points that are shifted are those of a survey, whose ranges say nothing.
        if self.shift == Vector3::zeros() {
            let doubt = UnitDoubt::of(first.iter().copied());
            doubt.into_iter().for_each(|doubt| output.note(format!("{}: {doubt}", file.display())));
        }
    }

    /// The points of a scan file near 0.
    ///
    /// # Errors
    /// The file cannot be read, or its points are still too far from 0 for f32.
    pub fn read(&self, file: &Path) -> Result<Vec<Point>, CliError> {
        let points = self.reader.read(file)?;
        self.check(&file.display().to_string(), &points)?;
        let zero = Point3::origin();
        // 0 0 0 says that nothing returned, wherever the survey is.
        let shifted = |point: Point3<f64>| if point == zero { point } else { point - self.shift };
        Ok(points.into_iter().map(|point| Point::from(shifted(point))).collect())
    }

    /// Points that messages call `name`, near 0.
    ///
    /// # Errors
    /// They are still too far from 0 for f32.
    pub fn near(&self, name: &str, points: &[Point3<f64>]) -> Result<Vec<Point>, CliError> {
        self.check(name, points)?;
        Ok(points.iter().map(|point| Point::from(point - self.shift)).collect())
    }

    fn check(&self, name: &str, points: &[Point3<f64>]) -> Result<(), CliError> {
        if !is_coarse(points, &self.shift, self.resolution_m) {
            return Ok(());
        }
        let [x, y, z] = first_place(points).unwrap_or_default();
        Err(CliError::failed(format!(
            "{name}: f32 rounds its points, as that near {x} {y} {z}, by more than 1/16 of a voxel of {} m: give \
             --origin \"{x} {y} {z}\" (or --origin auto), which is subtracted from all points and is the origin of the map",
            self.resolution_m
        )))
    }

    /// The pose in the map of a scan whose pose in the survey is known, for its points as [`Survey::read`] gives them.
    pub fn to_map(&self, survey_from_scan: &Pose) -> Pose {
        Translation3::from(-self.origin) * survey_from_scan * Translation3::from(self.shift)
    }

    /// The pose in the survey of a scan that was found in the map: what [`Survey::to_map`] makes undone.
    pub fn to_survey(&self, map_from_scan: &Pose) -> Pose {
        Translation3::from(self.origin) * map_from_scan * Translation3::from(-self.shift)
    }
}

/// True where f32 rounds half of the finite points or more too much: a few huge ones are those of drivers, for "nothing
/// returned".
fn is_coarse(points: &[Point3<f64>], shift: &Vector3<f64>, resolution_m: f64) -> bool {
    let filter = PointFilter::default();
    let is_point = |point: &&Point3<f64>| filter.is_return(Point::from(**point));
    let rounds = |point: &Point3<f64>| {
        let error = |c: f64| (half_step(c as f32)) > resolution_m * ROUNDING_SHARE;
        (point - shift).coords.iter().any(|c| error(*c))
    };
    let (mut finite, mut coarse) = (0usize, 0usize);
    for point in points.iter().filter(is_point) {
        finite += 1;
        coarse += usize::from(rounds(point));
    }
    finite > 0 && coarse * 2 >= finite
}

/// How far rounding to f32 may move a number of this size: half of the distance to the next one.
fn half_step(number: f32) -> f64 {
    (f64::from(number.abs().next_up()) - f64::from(number.abs())) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::scan::read_exact_points;
    use nalgebra::UnitQuaternion;

    fn written(points: &[[f64; 3]]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scan.xyz");
        let lines: Vec<String> = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
        std::fs::write(&path, lines.concat()).unwrap();
        (folder, path)
    }

    fn surveyed() -> Vec<[f64; 3]> {
        (0..100)
            .map(|i| [388_096.0 + 0.013 * f64::from(i), 3_948_996.5 - 0.017 * f64::from(i), 12.25])
            .collect()
    }

    /// Largest distance between the places that a survey gives in the map and the true ones.
    fn error_m(survey: &Survey, pose: &Pose, origin: [f64; 3]) -> f64 {
        let (_folder, path) = written(&surveyed());
        let map_from_scan = survey.to_map(pose);
        let read = survey.read(&path).unwrap();
        let error = |(point, xyz): (&Point, &[f64; 3])| {
            let truth = pose * Point3::from(*xyz) - Vector3::from(origin);
            (map_from_scan * point.to_f64() - truth).norm()
        };
        read.iter().zip(&surveyed()).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn a_pose_that_brings_a_survey_near_0_is_applied_exactly() {
        let (_folder, path) = written(&surveyed());
        let exact = read_exact_points(&path).unwrap();
        let survey = Survey::of(&exact, None, true, 0.05);
        let turned =
            Pose::from_parts(Translation3::identity(), UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3));
        let pose = turned * Translation3::new(-388_090.0, -3_948_990.0, 0.0);
        assert!(error_m(&survey, &pose, [0.0; 3]) < 1e-5);
        let found = survey.to_survey(&survey.to_map(&pose));
        assert!((found.translation.vector - pose.translation.vector).norm() < 1e-6);
    }

    #[test]
    fn an_origin_is_subtracted_with_poses_and_without() {
        let (_folder, path) = written(&surveyed());
        let exact = read_exact_points(&path).unwrap();
        let origin = OriginChoice::Auto.origin(&path, &exact).unwrap();
        assert_eq!(origin.position_m, [388_096.0, 3_948_997.0, 12.0]);
        for has_poses in [false, true] {
            let survey = Survey::of(&exact, Some(origin), has_poses, 0.05);
            assert!(error_m(&survey, &Pose::identity(), origin.position_m) < 1e-6);
            assert!(survey.to_map(&Pose::identity()).translation.vector.norm() < 1e-9);
        }
        // Poses of sensors in a survey, whose points are near them.
        let near: Vec<Point3<f64>> = vec![Point3::new(1.0, 2.0, 3.0); 9];
        let survey = Survey::of(&near, Some(origin), true, 0.05);
        let place = survey.to_map(&Pose::translation(388_100.0, 3_949_000.0, 12.0));
        assert_eq!(place.translation.vector, Vector3::new(4.0, 3.0, 0.0));
    }

    #[test]
    fn points_that_f32_holds_too_coarsely_are_refused_with_what_helps() {
        let (_folder, path) = written(&surveyed());
        let exact = read_exact_points(&path).unwrap();
        let refused = Survey::of(&exact, None, false, 0.05).read(&path).unwrap_err().to_string();
        assert!(
            refused.contains("scan.xyz") && refused.contains("--origin \"388096 3948997 12\""),
            "{refused}"
        );
        // A coarse map holds them, and near points are held by every map.
        assert!(Survey::of(&exact, None, false, 4.0).read(&path).is_ok());
        let (_folder, near) = written(&[[1000.0, -900.0, 3.0], [0.0, 0.0, 0.0], [1e9, 0.0, 0.0], [1.0; 3]]);
        let survey = Survey::of(&read_exact_points(&near).unwrap(), None, false, 0.01);
        assert_eq!(survey.read(&near).unwrap()[1], Point::new(0.0, 0.0, 0.0));
    }
}
