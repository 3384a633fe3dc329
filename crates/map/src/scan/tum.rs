//! Trajectories as TUM files, a line `id tx ty tz qx qy qz qw` for each scan; those of KITTI are read too.

use std::fmt::{self, Display};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::kitti;
use super::reader::{Problem, ReadError, content_lines, number, read_file};
use crate::geometry::{Pose, pose, rotation_xyzw, translation_m};

/// Number of columns of a line: id, tx ty tz in meters, qx qy qz qw.
const COLUMNS: usize = 8;

/// The pose of one scan of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedPose {
    /// A time in seconds or an index: an f64 keeps microseconds of today's times and every index below 2^53.
    pub id: f64,
    /// Pose of the sensor, map_from_sensor.
    pub map_from_sensor: Pose,
}

impl Display for StampedPose {
    /// Writes the pose's line: plain decimal numbers, each with the digits that give the same f64 when read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.id)?;
        let [translation, rotation] =
            [translation_m(&self.map_from_sensor).to_vec(), rotation_xyzw(&self.map_from_sensor).to_vec()];
        translation.iter().chain(&rotation).try_for_each(|number| write!(f, " {number}"))
    }
}

/// Which program's form the lines of a file of poses have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseForm {
    /// Eight numbers: id tx ty tz qx qy qz qw.
    Tum,
    /// Twelve numbers: the rows of the 3x4 matrix map_from_sensor. KITTI's own files have the poses of its left camera,
    /// in the axes of a camera.
    Kitti,
}

/// The poses of the file at `path`, in its order; blank lines and lines that start with `#` are skipped.
///
/// A line is one of TUM, eight numbers, or of KITTI, twelve; those of KITTI are numbered from 0.
///
/// # Errors
/// When the file cannot be read, or a line is none of these, has no pose, or is of another form than the first; the
/// error names the file and the line.
pub fn read_trajectory(path: &Path) -> Result<Vec<StampedPose>, ReadError> {
    read_poses(path).map(|(poses, _)| poses)
}

/// The poses of [`read_trajectory`], and the form of their lines; that of TUM where there is none.
///
/// # Errors
/// Those of [`read_trajectory`].
pub fn read_poses(path: &Path) -> Result<(Vec<StampedPose>, PoseForm), ReadError> {
    trajectory(&read_file(path)?).map_err(|problem| problem.in_file(path))
}

/// The poses in the `bytes` of a file as [`read_trajectory`] reads it; errors name `path`.
///
/// # Errors
/// Those of [`read_trajectory`], but for reading the file.
pub fn parse_trajectory(path: &Path, bytes: &[u8]) -> Result<Vec<StampedPose>, ReadError> {
    trajectory(bytes).map(|(poses, _)| poses).map_err(|problem| problem.in_file(path))
}

/// Writes `poses` to `path` as a TUM file; whole numbers have no decimal point.
///
/// # Errors
/// When the file cannot be written.
pub fn write_trajectory(path: &Path, poses: &[StampedPose]) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    for pose in poses {
        writeln!(file, "{pose}")?;
    }
    file.flush()
}

fn trajectory(bytes: &[u8]) -> Result<(Vec<StampedPose>, PoseForm), Problem> {
    let mut poses = Vec::new();
    let mut of_first = None;
    for (line, text) in content_lines(bytes)? {
        let at_line = |problem: String| Problem::at_line(line, problem);
        let (pose, form) = stamped_pose(&text, poses.len()).map_err(at_line)?;
        if *of_first.get_or_insert(form) != form {
            return Err(at_line("lines of 8 numbers (TUM) and of 12 (KITTI) are in one file".to_owned()));
        }
        poses.push(pose);
    }
    Ok((poses, of_first.unwrap_or(PoseForm::Tum)))
}

/// The pose of a line, which is number `line_number` of those with a pose.
fn stamped_pose(text: &str, line_number: usize) -> Result<(StampedPose, PoseForm), String> {
    let numbers: Vec<f64> = text.split_ascii_whitespace().map(number).collect::<Result<_, _>>()?;
    if let Ok(row) = <&[f64; kitti::COLUMNS]>::try_from(&numbers[..]) {
        let pose = StampedPose { id: line_number as f64, map_from_sensor: kitti::pose_of_row(row)? };
        return Ok((pose, PoseForm::Kitti));
    }
    let [id, tx, ty, tz, qx, qy, qz, qw] = numbers[..] else {
        return Err(format!(
            "{} numbers, {COLUMNS} are needed: id tx ty tz qx qy qz qw (or the {} of KITTI)",
            numbers.len(),
            kitti::COLUMNS
        ));
    };
    if !id.is_finite() {
        return Err(format!("the id must be finite, got {id}"));
    }
    let map_from_sensor = pose([tx, ty, tz], [qx, qy, qz, qw]).map_err(|error| error.to_string())?;
    Ok((StampedPose { id, map_from_sensor }, PoseForm::Tum))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};

    use super::*;

    fn stamped(id: f64) -> StampedPose {
        let rotation = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0 + id.fract());
        StampedPose {
            id,
            map_from_sensor: Pose::from_parts(Translation3::new(1e-9, -2.5, 1e3 / 3.0), rotation),
        }
    }

    #[test]
    fn a_trajectory_round_trips_through_a_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("poses.txt");
        let before = [stamped(0.0), stamped(7.0), stamped(1_630_577_771.070493)];
        write_trajectory(&path, &before).unwrap();
        let after = read_trajectory(&path).unwrap();
        for (a, b) in before.iter().zip(&after) {
            assert_eq!(a.id, b.id);
            assert_eq!(a.map_from_sensor.translation, b.map_from_sensor.translation);
            let difference = a.map_from_sensor.rotation.coords - b.map_from_sensor.rotation.coords;
            assert!(difference.norm() < 1e-15, "{difference}");
        }
        assert_eq!(after.len(), before.len());
    }

    #[test]
    fn a_whole_id_is_written_without_a_point() {
        let line = StampedPose { id: 12.0, map_from_sensor: Pose::identity() }.to_string();
        assert_eq!(line, "12 0 0 0 0 0 0 1");
        let line = StampedPose { id: 1_630_577_771.070493, map_from_sensor: Pose::identity() }.to_string();
        assert!(line.starts_with("1630577771.070493 "), "{line}");
    }

    #[test]
    fn comments_blank_lines_and_windows_line_ends_are_accepted() {
        let (poses, form) = trajectory(b"# id tx ty tz\r\n\r\n1 0 0 0 0 0 0 1\r\n  2 0 0 0 0 0 0 1").unwrap();
        assert_eq!(poses.iter().map(|pose| pose.id).collect::<Vec<_>>(), [1.0, 2.0]);
        assert_eq!(form, PoseForm::Tum);
    }

    #[test]
    fn lines_of_kitti_are_the_same_poses_by_rows() {
        let line = |pose: &StampedPose| {
            let matrix = pose.map_from_sensor.to_homogeneous();
            let rows = (0..3).flat_map(|row| (0..4).map(move |column| matrix[(row, column)]));
            rows.map(|number| format!("{number:.6e} ")).collect::<String>() + "\n"
        };
        let before = [stamped(0.0), stamped(0.4)];
        let (after, form) = trajectory(before.iter().map(line).collect::<String>().as_bytes()).unwrap();
        assert_eq!((form, after.len()), (PoseForm::Kitti, 2));
        for (k, (a, b)) in before.iter().zip(&after).enumerate() {
            assert_eq!(b.id, k as f64);
            let difference = a.map_from_sensor.inv_mul(&b.map_from_sensor);
            assert!(difference.translation.vector.norm() < 1e-3 && difference.rotation.angle() < 1e-5);
            assert!((b.map_from_sensor.rotation.norm() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn an_error_names_file_line_and_problem() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("poses.txt");
        for (line, problem) in [
            ("1 0 0 0 0 0 0", "7 numbers"),
            ("1 0 0 0 0 0 0 1 5", "9 numbers"),
            ("1 0 zero 0 0 0 0 1", "\"zero\""),
            ("1 0 0 0 0 0 0 2", "norm 2"),
            ("nan 0 0 0 0 0 0 1", "finite"),
            ("1 inf 0 0 0 0 0 1", "finite"),
            ("1 0 0 0 0 1 0 0 0 0 1 0", "in one file"),
            ("1 0 0 0 0 1 0 0 0 0 1 nan", "finite"),
            ("2 0 0 0 0 1 0 0 0 0 1 0", "off by 3.000"),
            ("1 0 0 0 0 1 0 0 0 0 -1 0", "reflection"),
        ] {
            std::fs::write(&path, format!("# comment\n0 0 0 0 0 0 0 1\n{line}\n")).unwrap();
            let error = read_trajectory(&path).unwrap_err().to_string();
            assert!(error.contains("poses.txt:3: ") && error.contains(problem), "{error}");
        }
        assert!(matches!(read_trajectory(&directory.path().join("none")), Err(ReadError::Io { .. })));
    }
}
