//! Scans from files, with the poses where they were taken.

use std::path::{Path, PathBuf};

use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol::console::truth::true_poses;
use mrol_map::scan::{read_points, scan_files};

/// The finite points of each scan file in `paths`, `scans_max` of them at most, with its true pose where `truth` is
/// given.
pub(super) fn read(
    paths: &[PathBuf],
    truth: Option<&Path>,
    scans_max: usize,
    output: &Output,
) -> Result<Vec<Scan>, CliError> {
    let mut files = scan_files(paths)?;
    files.truncate(scans_max);
    let poses = truth.map(|path| true_poses(path, files.len(), output)).transpose()?;
    let read = |(k, file): (usize, &PathBuf)| {
        let map_from_sensor = poses.as_ref().map(|poses| poses[k]);
        Ok(Scan::of_finite(read_points(file)?, map_from_sensor))
    };
    files.iter().enumerate().map(read).collect()
}
