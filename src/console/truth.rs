//! The true poses of scans, from a file.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::output::Output;
use super::poses_by_time::{are_numbered, poses_at, times_of};
use mrol_map::geometry::Pose;
use mrol_map::scan::{PoseForm, StampedPose, read_poses, read_uos_pose};

/// Where the numbers of lines do not go on by one, as those of a trajectory without its refused scans; none where they
/// are times.
fn gap_of(poses: &[StampedPose]) -> Option<[f64; 2]> {
    if !are_numbered(poses) {
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
        return poses_of_file(path, files, output);
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

/// The poses of a file: at the times that the scans are named by, where its lines are times too, else line k for scan
/// k.
fn poses_of_file(path: &Path, files: &[PathBuf], output: &Output) -> Result<Vec<Pose>, CliError> {
    let (stamped, form) = read_poses(path)?;
    if form != PoseForm::Tum || are_numbered(&stamped) {
        return poses_in_order(path, (stamped, form), files.len(), output);
    }
    match times_of(files) {
        Ok(Some(times_s)) => poses_at(path, stamped, files, &times_s, output),
        // As many lines as scans are theirs, whatever these are called.
        Err(file) if stamped.len() != files.len() => Err(CliError::failed(format!(
            "{}: its {} lines are times, and there are {} scans, of which {} is not named by a time in seconds: name \
             each as 1305031102.160407, or give a line a scan",
            path.display(),
            stamped.len(),
            files.len(),
            file.display()
        ))),
        Ok(None) | Err(_) => poses_in_order(path, (stamped, form), files.len(), output),
    }
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
    if !are_numbered(&stamped) && !stamped.is_sorted_by(|a, b| a.id <= b.id) {
        output.note(format!(
            "{file}: the times of its lines do not rise: poses are taken in order, line k for scan k"
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
    fn what_cannot_be_matched_by_time_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.txt");
        let output = Output::new(false);
        let poses = |ids: &[f64], names: &[&str]| {
            let line = |(k, id): (usize, &f64)| format!("{id} {k} 0 0 0 0 0 1\n");
            std::fs::write(&path, ids.iter().enumerate().map(line).collect::<String>()).unwrap();
            let files: Vec<PathBuf> = names.iter().map(|name| PathBuf::from(format!("{name}.png"))).collect();
            let poses = poses_of_scans(&path, &files, &output).map_err(|error| error.to_string())?;
            Ok::<_, String>(poses.iter().map(|pose| pose.translation.x).collect::<Vec<_>>())
        };
        // A time may be whole, and one line may be of the clock's beginning.
        assert_eq!(poses(&[9.9, 10.0, 10.1, 0.0], &["9.95", "10.0"]).unwrap().len(), 2);
        assert_eq!(poses(&[0.0, 0.1, 0.2], &["0.000000", "0.200000"]), Ok(vec![0.0, 2.0]));
        assert_eq!(poses(&[0.0, 1.0, 2.0], &["0", "1", "2"]), Ok(vec![0.0, 1.0, 2.0]));
        for (ids, names, told) in [
            (&[9.9, 10.0, 10.1][..], &["10.05", "avg"][..], "avg.png is not named by a time"),
            (&[9.9, 10.0, 10.1], &["depth_1305031102.16"], "is not named by a time"),
            (&[9.9, 10.0, 10.0, 10.1], &["9.95"], "two lines have different poses at 10 s"),
            (&[1.3e18, 1.4e18], &["1305031102160000000"], "in nanoseconds?"),
        ] {
            let refused = poses(ids, names).unwrap_err();
            assert!(refused.contains(told), "{refused}");
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
