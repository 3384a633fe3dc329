//! The true poses of scans, from a file.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::output::Output;
use mrol_map::geometry::Pose;
use mrol_map::scan::{PoseForm, StampedPose, read_poses, read_uos_pose};

/// Numbers of scans, and not times: below this, and whole.
const NUMBER_MAX: f64 = 1e6;

/// Where the numbers of lines do not go on by one, as those of a trajectory without its refused scans; none where they
/// are times.
fn gap_of(poses: &[StampedPose]) -> Option<[f64; 2]> {
    if !poses.iter().all(|pose| pose.id.fract() == 0.0 && (0.0..NUMBER_MAX).contains(&pose.id)) {
        return None;
    }
    let pairs = poses.windows(2).map(|pair| [pair[0].id, pair[1].id]);
    pairs.into_iter().find(|[before, after]| *after != before + 1.0)
}

/// The poses map_from_sensor of the scans in `files`: those of a file, line k for scan k, or of a folder, where each
/// scan has a `.pose` file of 3DTK with its name.
///
/// # Errors
/// When there is not a pose for each scan, or a file cannot be read.
pub fn poses_of_scans(path: &Path, files: &[PathBuf], output: &Output) -> Result<Vec<Pose>, CliError> {
    if !path.is_dir() {
        return true_poses(path, files.len(), output);
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

/// The true poses of `scans` scans, map_from_sensor: line k belongs to scan k.
pub fn true_poses(path: &Path, scans: usize, output: &Output) -> Result<Vec<Pose>, CliError> {
    let (stamped, form) = read_poses(path)?;
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
