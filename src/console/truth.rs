//! The true poses of scans, from a file.

use std::path::Path;

use super::error::CliError;
use super::output::Output;
use mrol_map::geometry::Pose;
use mrol_map::scan::read_trajectory;

/// The true poses of `scans` scans, map_from_sensor: line k belongs to scan k.
pub fn true_poses(path: &Path, scans: usize, output: &Output) -> Result<Vec<Pose>, CliError> {
    let mut poses: Vec<Pose> = read_trajectory(path)?.iter().map(|pose| pose.map_from_sensor).collect();
    let (file, count) = (path.display(), poses.len());
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
