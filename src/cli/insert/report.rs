//! Output of `mrol insert`.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use crate::cli::scan_report::{PLACE_HEAD, place};
use mrol::console::count;
use mrol::json::JsonScan;
use mrol_map::scan::SkippedPoints;
use mrol_service::ScanAnswer;

/// A scan that the server failed to insert.
#[derive(Serialize)]
pub(super) struct FailedLine {
    pub(super) scan: String,
    pub(super) error: String,
}

impl Display for FailedLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}  {}", self.scan, self.error)
    }
}

/// The line of a scan that was answered.
#[derive(Serialize)]
pub(super) struct ScanLine {
    scan: String,
    #[serde(flatten)]
    answer: JsonScan,
    #[serde(skip)]
    width: usize,
}

impl ScanLine {
    pub(super) fn of(scan: String, answer: &ScanAnswer, width: usize) -> Self {
        Self { scan, answer: answer.clone().into(), width }
    }

    pub(super) fn head(width: usize) -> String {
        format!("{:<width$}  verdict       overlap  {PLACE_HEAD}  new voxels  revision", "scan")
    }
}

impl Display for ScanLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<width$}  {:<12}  {:>7.3}  {}  {:>10}  {:>8}",
            self.scan,
            self.answer.verdict,
            self.answer.overlap,
            place(&self.answer.map_from_sensor),
            count(self.answer.new_voxels),
            self.answer.version.revision,
            width = self.width
        )?;
        match &self.answer {
            JsonScan { replayed: true, .. } => write!(f, "  (was there already)"),
            JsonScan { stationary: true, .. } => write!(f, "  (nothing new from where it stands)"),
            JsonScan { recovered: Some(how), .. } => write!(f, "  recovered: {how}"),
            JsonScan { verdict: "accepted", carved_voxels: 0, .. } => Ok(()),
            JsonScan { verdict: "accepted", carved_voxels, .. } => {
                write!(f, "  {} carved", count(*carved_voxels))
            }
            JsonScan { reason, .. } => return write!(f, "  {reason}"),
        }?;
        match &self.answer {
            JsonScan { reason, .. } if SkippedPoints::is_told_in(reason) => write!(f, "  {reason}"),
            JsonScan { points_skipped: 0, .. } => Ok(()),
            JsonScan { points_skipped, .. } => write!(f, "  {} points skipped", count(*points_skipped)),
        }
    }
}
