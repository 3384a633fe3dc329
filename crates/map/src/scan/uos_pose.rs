//! Poses of 3DTK: a `.pose` file beside each scan of the format `uos`.

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::reader::{Problem, ReadError, content_lines, number, read_file, robot_from_uos};
use crate::geometry::Pose;

/// Numbers of a file: x y z in centimeters, then three angles in degrees.
const NUMBERS: usize = 6;

/// The pose map_from_sensor in the `.pose` file at `path`, x ahead, y left, z up, meters.
///
/// The file has x y z in centimeters, and the angles of turns about x, y and z in degrees, both in the axes of 3DTK: x
/// right, y up, z ahead, left-handed. Its rotation is Rx Ry Rz.
///
/// # Errors
/// When the file cannot be read, or has other than six finite numbers.
pub fn read_uos_pose(path: &Path) -> Result<Pose, ReadError> {
    pose_of(&read_file(path)?).map_err(|problem| problem.in_file(path))
}

fn pose_of(bytes: &[u8]) -> Result<Pose, Problem> {
    let mut numbers: Vec<f64> = Vec::with_capacity(NUMBERS);
    for (line, text) in content_lines(bytes)? {
        for token in text.split_ascii_whitespace() {
            let found: f64 = number(token).map_err(|problem| Problem::at_line(line, problem))?;
            if !found.is_finite() {
                return Err(Problem::at_line(line, format!("a pose is of finite numbers, got {found}")));
            }
            if numbers.len() == NUMBERS {
                return Err(Problem::at_line(line, "more than the 6 numbers of a pose of 3DTK"));
            }
            numbers.push(found);
        }
    }
    let [x, y, z, about_x, about_y, about_z] = numbers[..] else {
        return Err(Problem::new(format!(
            "{} numbers, a pose of 3DTK has {NUMBERS}: x y z in centimeters, three angles in degrees",
            numbers.len()
        )));
    };
    let turn = |axis, degrees: f64| Rotation3::from_axis_angle(&axis, degrees.to_radians());
    let rotation = turn(Vector3::x_axis(), about_x)
        * turn(Vector3::y_axis(), about_y)
        * turn(Vector3::z_axis(), about_z);
    // The change of axes is a reflection: a rotation between two of them is one again.
    let axes = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let rotation = Rotation3::from_matrix_unchecked(axes * rotation.matrix() * axes.transpose());
    let translation = Translation3::from(Vector3::from(robot_from_uos([x, y, z])));
    Ok(Pose::from_parts(translation, UnitQuaternion::from_rotation_matrix(&rotation)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation_xyzw;
    use crate::scan::parse_points;

    #[test]
    fn a_turn_to_the_right_about_the_axis_up_is_one_to_the_right() {
        // Left-handed: a positive angle about y, which is up, turns ahead (z) to the right (x).
        let pose = pose_of(b"100 50 200\n0 90 0\n").unwrap();
        assert!((pose.translation.vector - Vector3::new(2.0, -1.0, 0.5)).norm() < 1e-12);
        let ahead = pose.rotation * Vector3::x();
        assert!((ahead - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-12, "{ahead}");
    }

    #[test]
    fn points_and_poses_change_their_axes_alike() {
        // By the matrix that 3DTK makes of three angles, column by column.
        let [x, y, z] = [20.0_f64, -35.0, 70.0].map(f64::to_radians);
        let ((sx, cx), (sy, cy), (sz, cz)) = (x.sin_cos(), y.sin_cos(), z.sin_cos());
        let columns = [
            [cy * cz, sx * sy * cz + cx * sz, -cx * sy * cz + sx * sz],
            [-cy * sz, -sx * sy * sz + cx * cz, cx * sy * sz + sx * cz],
            [sy, -sx * cy, cx * cy],
        ];
        let (point, moved) = ([120.0, -30.0, 410.0], [7.0, -250.0, 33.0]);
        let in_map = |row: usize| (0..3).map(|k| columns[k][row] * point[k]).sum::<f64>() + moved[row];
        let truth = robot_from_uos([in_map(0), in_map(1), in_map(2)]);
        let pose = pose_of(b"7 -250 33\r\n20 -35 70\r\n\r\n").unwrap();
        let found = pose * nalgebra::Point3::from(robot_from_uos(point));
        assert!((found.coords - Vector3::from(truth)).norm() < 1e-12, "{found} {truth:?}");
    }

    #[test]
    fn a_pose_of_the_example_of_3dtk_is_the_one_that_others_made_of_it() {
        // In axes with y down, right-handed, the rotation is x y z w = -0.0118772831 -0.00737989522 0.00499405154 ..
        let pose = pose_of(b"-3.10605 -7.50803 156.917\n1.35694 -0.852409 -0.56224\n\n").unwrap();
        let [x, y, z, w] = rotation_xyzw(&pose);
        let truth = [0.00499405154, 0.0118772831, 0.00737989522, 0.999889757];
        assert!([x, y, z, w].iter().zip(truth).all(|(c, truth)| (c - truth).abs() < 1e-8), "{x} {y} {z} {w}");
    }

    #[test]
    fn a_scan_has_its_first_three_columns_and_may_begin_with_a_count() {
        for text in
            ["100 20 300\n0 0 0\n", "2\n100 20 300 57\n0 0 0 0\n", "# a scan\n100 20 300 1 2\n0 0 0 1 2\n"]
        {
            let points = parse_points(Path::new("scan000.3d"), text.as_bytes()).unwrap();
            let xyz: Vec<_> = points.iter().map(|point| point.xyz()).collect();
            assert_eq!(xyz, [[3.0, -1.0, 0.2], [0.0; 3]], "{text}");
        }
        let error = parse_points(Path::new("scan000.3d"), b"3\n1 2 3\n").unwrap_err().to_string();
        assert!(error.contains("scan000.3d:1: 3 points are declared"), "{error}");
    }

    #[test]
    fn what_is_no_pose_says_why() {
        for (text, why) in [
            ("1 2 3\n4 5\n", "5 numbers"),
            ("1 2 3\n4 5 6\n7\n", "more than the 6"),
            ("1 2 nan\n4 5 6\n", "finite"),
            ("1 2 a\n4 5 6\n", "\"a\""),
            ("", "0 numbers"),
        ] {
            let error = pose_of(text.as_bytes()).unwrap_err().in_file(Path::new("scan000.pose")).to_string();
            assert!(error.contains("scan000.pose") && error.contains(why), "{error}");
        }
    }
}
