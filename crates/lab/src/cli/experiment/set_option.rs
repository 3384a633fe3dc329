//! Sets of real scans, as they are named on the command line.

use std::path::PathBuf;
use std::str::FromStr;

use crate::experiment::verdicts::Set;
use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol::console::truth::true_poses;
use mrol_map::geometry::Pose;
use mrol_map::scan::{read_points, scan_files};

/// A set of scans: its folder, the side of a voxel, and the place it shows.
#[derive(Debug, Clone)]
pub(super) struct SetOption {
    folder: PathBuf,
    resolution_m: f64,
    place: String,
}

impl FromStr for SetOption {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("must be DIR:RESOLUTION:PLACE, as in hall/:0.1:hall, got {text}");
        let mut parts = text.rsplitn(3, ':');
        let (place, resolution_m) = (parts.next(), parts.next().and_then(|text| text.parse().ok()));
        let (place, resolution_m, folder) = (
            place.ok_or_else(expected)?,
            resolution_m.ok_or_else(expected)?,
            parts.next().ok_or_else(expected)?,
        );
        Ok(Self { folder: folder.into(), resolution_m, place: place.to_owned() })
    }
}

impl SetOption {
    /// The scans, with their true poses.
    fn scans(&self, output: &Output) -> Result<Vec<Scan>, CliError> {
        let files = scan_files(std::slice::from_ref(&self.folder))?;
        let poses = true_poses(&self.folder.join("poses.txt"), files.len(), output)?;
        let scan = |(file, pose): (&PathBuf, Pose)| Ok(Scan::of_finite(read_points(file)?, Some(pose)));
        files.iter().zip(poses).map(scan).collect()
    }

    /// At most `most` of its scans.
    pub(super) fn read(&self, most: usize, output: &Output) -> Result<Set, CliError> {
        Ok(Set::of(&self.name(), &self.place, self.scans(output)?, self.resolution_m, most))
    }

    fn name(&self) -> String {
        self.folder.file_name().unwrap_or(self.folder.as_os_str()).to_string_lossy().into_owned()
    }
}
