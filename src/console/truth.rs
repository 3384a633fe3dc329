//! The true poses of scans, from a file.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::output::Output;
use mrol_map::geometry::{Pose, Twist};
use mrol_map::scan::{PoseForm, StampedPose, read_poses, read_uos_pose};

/// Numbers of scans, and not times: below this, and whole.
const NUMBER_MAX: f64 = 1e6;

/// How far apart in time two lines may be that a pose is taken between.
const APART_MAX_S: f64 = 0.2;

/// True of a time in seconds, and not of the number of a scan.
fn is_time(number: f64) -> bool {
    number.is_finite() && (number.fract() != 0.0 || number >= NUMBER_MAX)
}

/// The times that files are named by, seconds; none where a name is none.
fn times_of(files: &[PathBuf]) -> Option<Vec<f64>> {
    let time = |file: &PathBuf| file.file_stem()?.to_str()?.parse().ok().filter(|&time| is_time(time));
    files.iter().map(time).collect()
}

/// Where the numbers of lines do not go on by one, as those of a trajectory without its refused scans; none where they
/// are times.
fn gap_of(poses: &[StampedPose]) -> Option<[f64; 2]> {
    if !poses.iter().all(|pose| pose.id.fract() == 0.0 && (0.0..NUMBER_MAX).contains(&pose.id)) {
        return None;
    }
    let pairs = poses.windows(2).map(|pair| [pair[0].id, pair[1].id]);
    pairs.into_iter().find(|[before, after]| *after != before + 1.0)
}

/// The poses map_from_sensor of the scans in `files`: those of a file, or of a folder, where each scan has a `.pose`
/// file of 3DTK with its name.
///
/// Line k of a file is for scan k; where its lines and the names of the scans are times in seconds, as in the RGB-D
/// sets of TUM, the poses at the times of the scans are taken, between two lines.
///
/// # Errors
/// When there is not a pose for each scan, or a file cannot be read.
pub fn poses_of_scans(path: &Path, files: &[PathBuf], output: &Output) -> Result<Vec<Pose>, CliError> {
    if !path.is_dir() {
        return match times_of(files) {
            Some(times_s) => poses_at(path, files, &times_s, output),
            None => true_poses(path, files.len(), output),
        };
    }
    let beside = |file: &PathBuf| path.join(file.file_name().unwrap_or_default()).with_extension("pose");
    if let Some(file) = files.first().filter(|file| !beside(file).exists()) {
        return Err(CliError::failed(format!(
            "{}: there is no {}: of a folder, each scan has a .pose file of 3DTK with its name; poses of TUM and KITTI are \
             one file",
            path.display(),
            beside(file).file_name().unwrap_or_default().display()
        )));
    }
    Ok(files.iter().map(|file| read_uos_pose(&beside(file))).collect::<Result<_, _>>()?)
}

/// The poses of scans that were taken at `times_s`: between two lines where these are times too, else line k of scan k.
fn poses_at(path: &Path, files: &[PathBuf], times_s: &[f64], output: &Output) -> Result<Vec<Pose>, CliError> {
    let (mut stamped, form) = read_poses(path)?;
    if stamped.is_empty() || !stamped.iter().all(|pose| is_time(pose.id)) {
        return poses_in_order(path, (stamped, form), files.len(), output);
    }
    stamped.sort_by(|a, b| a.id.total_cmp(&b.id));
    output.note(format!("{}: the poses at the times that the scans are named by", path.display()));
    let pose = |(file, &time_s): (&PathBuf, &f64)| {
        between(&stamped, time_s).ok_or_else(|| {
            CliError::failed(format!(
                "{}: no pose for {}: its name is a time, {time_s} s, with no two lines around it that are at most \
                 {APART_MAX_S} s apart; leave it out",
                path.display(),
                file.display()
            ))
        })
    };
    files.iter().zip(times_s).map(pose).collect()
}

/// The pose at a time between two lines, which are sorted by time.
fn between(sorted: &[StampedPose], time_s: f64) -> Option<Pose> {
    let after = sorted.partition_point(|pose| pose.id < time_s);
    let next = sorted.get(after)?;
    if next.id == time_s {
        return Some(next.map_from_sensor);
    }
    let last = &sorted[after.checked_sub(1)?];
    let (passed_s, apart_s) = (time_s - last.id, next.id - last.id);
    let is_near = apart_s <= APART_MAX_S;
    is_near.then(|| {
        let motion = Twist::of_motion(&last.map_from_sensor.inv_mul(&next.map_from_sensor), apart_s);
        last.map_from_sensor * motion.motion(passed_s)
    })
}

/// The true poses of `scans` scans, map_from_sensor: line k belongs to scan k.
pub fn true_poses(path: &Path, scans: usize, output: &Output) -> Result<Vec<Pose>, CliError> {
    poses_in_order(path, read_poses(path)?, scans, output)
}

fn poses_in_order(
    path: &Path,
    (stamped, form): (Vec<StampedPose>, PoseForm),
    scans: usize,
    output: &Output,
) -> Result<Vec<Pose>, CliError> {
    let (file, count) = (path.display(), stamped.len());
    if form == PoseForm::Kitti {
        output.note(format!(
            "{file}: 12 numbers a line, as KITTI writes them: they are taken as map_from_sensor of the scans. KITTI's own \
             files are of its left camera (x right, y down, z ahead): for clouds of its lidar multiply each by Tr of calib.txt"
        ));
    }
    if let Some([before, after]) = gap_of(&stamped) {
        output.note(format!(
            "{file}: its lines are numbered, and {after} comes after {before}: poses are taken in order all the same, line k \
             for scan k"
        ));
    }
    let mut poses: Vec<Pose> = stamped.iter().map(|pose| pose.map_from_sensor).collect();
    if count < scans {
        let message = format!("{file}: {count} poses for {scans} scans: there must be a line a scan");
        return Err(CliError::failed(message));
    }
    if count > scans {
        output.note(format!("{file}: {count} poses for {scans} scans: the first {scans} are used, in order"));
        poses.truncate(scans);
    }
    Ok(poses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_at_a_time_lies_between_two_lines_near_it() {
        let line = |id: f64, x: f64| StampedPose { id, map_from_sensor: Pose::translation(x, 0.0, 0.0) };
        let lines = [line(10.0, 0.0), line(10.1, 1.0), line(10.5, 2.0)];
        let x = |time_s| between(&lines, time_s).map(|pose| pose.translation.x);
        assert_eq!((x(10.0), x(10.1), x(10.5)), (Some(0.0), Some(1.0), Some(2.0)));
        assert!((x(10.025).unwrap() - 0.25).abs() < 1e-9);
        assert_eq!((x(9.9), x(10.3), x(10.6)), (None, None, None));
    }

    #[test]
    fn names_are_times_where_all_are() {
        let files = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let times = times_of(&files(&["d/1305031102.160407.png", "d/1305031103.png"]));
        assert_eq!(times, Some(vec![1_305_031_102.160_407, 1_305_031_103.0]));
        for none in [&["d/7.png"][..], &["d/1305031102.160407.png", "d/0.png"], &["d/a.png"], &["d/nan.png"]]
        {
            assert_eq!(times_of(&files(none)), None, "{none:?}");
        }
    }

    #[test]
    fn numbers_that_leave_one_out_have_a_gap_and_times_have_none() {
        let poses = |ids: &[f64]| -> Vec<_> {
            ids.iter().map(|&id| StampedPose { id, map_from_sensor: Pose::identity() }).collect()
        };
        assert_eq!(gap_of(&poses(&[0.0, 1.0, 3.0, 4.0])), Some([1.0, 3.0]));
        assert_eq!(gap_of(&poses(&[2.0, 1.0])), Some([2.0, 1.0]));
        for none in [&[][..], &[7.0], &[5.0, 6.0, 7.0], &[0.0, 0.1, 0.5], &[1_764_370_870.0, 1_764_370_872.0]]
        {
            assert_eq!(gap_of(&poses(none)), None, "{none:?}");
        }
    }
}
