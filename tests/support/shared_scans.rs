//! Real and rendered scans that lie beside the repository, where they do.

use std::path::{Path, PathBuf};

use mrol::geometry::{Point, Pose};
use mrol::scan;

use crate::support::skipped::skipped;

/// The sets of scans with true poses.
pub const SETS: [&str; 5] =
    ["uos_3dtk_dat", "icl_office_kt0", "icl_office_kt0_dense", "balm_hall_consecutive", "street_hdl64"];

/// A sequence of scans with the true pose of each.
pub struct ScanSet {
    pub name: &'static str,
    pub files: Vec<PathBuf>,
    pub map_from_sensor: Vec<Pose>,
}

impl ScanSet {
    /// The finite points of scan `k`, sensor frame.
    pub fn points(&self, k: usize) -> Vec<Point> {
        let points = scan::read_points(&self.files[k]).expect("a shared scan can be read");
        points.into_iter().filter(|point| point.is_finite()).collect()
    }
}

/// The set `name`; none, said loudly, where the folder of scans is not there.
pub fn open(name: &'static str) -> Option<ScanSet> {
    let folder = match std::env::var_os("MROL_SCANS") {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
    };
    let folder = folder.join(name);
    if !folder.is_dir() {
        skipped(format!("no scans in {} (set MROL_SCANS to their folder)", folder.display()));
        return None;
    }
    let poses = scan::read_trajectory(&folder.join("poses.txt")).expect("true poses");
    let files = scan::scan_files(&[folder]).expect("scan files");
    assert_eq!(files.len(), poses.len());
    Some(ScanSet {
        name,
        files,
        map_from_sensor: poses.into_iter().map(|pose| pose.map_from_sensor).collect(),
    })
}
