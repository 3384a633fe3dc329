//! Trajectories as TUM files: a line `id tx ty tz qx qy qz qw` for each scan.

use std::fmt::{self, Display};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

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

/// The poses of the TUM file at `path`, in its order; blank lines and lines that start with `#` are skipped.
///
/// # Errors
/// When the file cannot be read or a line is not eight numbers of which the last seven are a pose; the error
/// names the file and the line.
pub fn read_trajectory(path: &Path) -> Result<Vec<StampedPose>, ReadError> {
    parse_trajectory(path, &read_file(path)?)
}

/// The poses in the `bytes` of a TUM file; errors name `path`.
///
/// # Errors
/// When a line is not eight numbers of which the last seven are a pose.
pub fn parse_trajectory(path: &Path, bytes: &[u8]) -> Result<Vec<StampedPose>, ReadError> {
    trajectory(bytes).map_err(|problem| problem.in_file(path))
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

fn trajectory(bytes: &[u8]) -> Result<Vec<StampedPose>, Problem> {
    let mut poses = Vec::new();
    for (line, text) in content_lines(bytes)? {
        poses.push(stamped_pose(&text).map_err(|problem| Problem::at_line(line, problem))?);
    }
    Ok(poses)
}

fn stamped_pose(text: &str) -> Result<StampedPose, String> {
    let numbers: Vec<f64> = text.split_ascii_whitespace().map(number).collect::<Result<_, _>>()?;
    let [id, tx, ty, tz, qx, qy, qz, qw] = numbers[..] else {
        return Err(format!("{} numbers, {COLUMNS} are needed: id tx ty tz qx qy qz qw", numbers.len()));
    };
    if !id.is_finite() {
        return Err(format!("the id must be finite, got {id}"));
    }
    let map_from_sensor = pose([tx, ty, tz], [qx, qy, qz, qw]).map_err(|error| error.to_string())?;
    Ok(StampedPose { id, map_from_sensor })
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
        let poses = trajectory(b"# id tx ty tz\r\n\r\n1 0 0 0 0 0 0 1\r\n  2 0 0 0 0 0 0 1").unwrap();
        assert_eq!(poses.iter().map(|pose| pose.id).collect::<Vec<_>>(), [1.0, 2.0]);
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
        ] {
            std::fs::write(&path, format!("# comment\n0 0 0 0 0 0 0 1\n{line}\n")).unwrap();
            let error = read_trajectory(&path).unwrap_err().to_string();
            assert!(error.contains("poses.txt:3: ") && error.contains(problem), "{error}");
        }
        assert!(matches!(read_trajectory(&directory.path().join("none")), Err(ReadError::Io { .. })));
    }
}
