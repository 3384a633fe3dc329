//! Output of `mrol map`.

use std::fmt;
use std::fmt::Display;

use serde::{Serialize, Serializer};

use crate::cli::scan_report::{PLACE_HEAD, place};
use mrol::console::count;
use mrol::json::JsonPose;
use mrol::offline::ErrorSummary;
use mrol::offline::FilterSummary;
use mrol::offline::Mapped;
use mrol_map::scan::SkippedPoints;
use mrol_map::util::Keyword;

/// The line of a scan.
#[derive(Serialize)]
pub(super) struct ScanLine {
    scan: String,
    accepted: bool,
    verdict: &'static str,
    reason: String,
    map_from_sensor: JsonPose,
    overlap: f64,
    level_overlaps: Vec<f64>,
    inliers: f64,
    information: [[f64; 6]; 6],
    iterations: u32,
    new_voxels: usize,
    carved_voxels: usize,
    voxels: usize,
    points_skipped: usize,
    #[serde(skip)]
    is_mostly_beyond: bool,
    align_ms: f64,
    insert_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    recovered: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_deg: Option<f64>,
    #[serde(skip)]
    name_width: usize,
}

impl ScanLine {
    pub(super) fn of(
        scan: String,
        mapped: &Mapped,
        skipped: &SkippedPoints,
        error: Option<(f64, f64)>,
        name_width: usize,
    ) -> Self {
        Self {
            scan,
            accepted: mapped.accepted(),
            verdict: mapped.alignment.verdict.as_str(),
            reason: skipped.explain(mapped.accepted(), &mapped.alignment.reason),
            points_skipped: skipped.total(),
            is_mostly_beyond: skipped.is_mostly_beyond(),
            map_from_sensor: (&mapped.alignment.map_from_sensor).into(),
            overlap: mapped.alignment.overlap(),
            level_overlaps: mapped.alignment.level_overlaps.clone(),
            inliers: mapped.alignment.inliers,
            information: mapped.alignment.information.rows(),
            iterations: mapped.alignment.iterations,
            new_voxels: mapped.new_voxels,
            carved_voxels: mapped.carved_voxels,
            voxels: mapped.voxels,
            align_ms: mapped.align_time.as_secs_f64() * 1e3,
            insert_ms: mapped.insert_time.as_secs_f64() * 1e3,
            recovered: mapped.recovered.map(Keyword::as_str),
            error_m: error.map(|(meters, _)| meters),
            error_deg: error.map(|(_, degrees)| degrees),
            name_width,
        }
    }

    /// The line above those of the scans.
    pub(super) fn head(name_width: usize, with_errors: bool) -> String {
        let errors = if with_errors { "   error m      deg" } else { "" };
        format!(
            "{:<name_width$}  verdict       overlap  {PLACE_HEAD}  new voxels        voxels  align ms  insert ms{errors}",
            "scan"
        )
    }
}

impl Display for ScanLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<width$}  {:<12}  {:>7.3}  {}  {:>10}  {:>12}  {:>8.1}  {:>9.1}",
            self.scan,
            self.verdict,
            self.overlap,
            place(&self.map_from_sensor),
            count(self.new_voxels),
            count(self.voxels),
            self.align_ms,
            self.insert_ms,
            width = self.name_width
        )?;
        match (self.error_m, self.error_deg) {
            (Some(meters), Some(degrees)) => write!(f, "  {meters:>8.4}  {degrees:>7.3}")?,
            _ if !self.accepted => write!(f, "  {}", self.reason)?,
            _ => {}
        }
        match self.accepted && self.points_skipped > 0 {
            true if self.is_mostly_beyond => write!(f, "  {}", self.reason)?,
            true => write!(f, "  {} points skipped", count(self.points_skipped))?,
            false => {}
        }
        if self.carved_voxels > 0 {
            write!(f, "  {} carved", count(self.carved_voxels))?;
        }
        if let Some(how) = self.recovered {
            write!(f, "  recovered: {how}")?;
        }
        Ok(())
    }
}

/// The line of a scan that has no point to map.
#[derive(Serialize)]
pub(super) struct SkippedLine {
    scan: String,
    accepted: bool,
    skipped: bool,
    reason: String,
    #[serde(skip)]
    name_width: usize,
}

impl SkippedLine {
    pub(super) fn of(scan: String, reason: String, name_width: usize) -> Self {
        Self { scan, accepted: false, skipped: true, reason, name_width }
    }
}

impl Display for SkippedLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<width$}  skipped       {}", self.scan, self.reason, width = self.name_width)
    }
}

/// Summary of a run.
#[derive(Debug, Clone)]
pub(super) struct Summary {
    pub(super) scans: usize,
    pub(super) accepted: usize,
    pub(super) refused: usize,
    /// Scans that had no point to map.
    pub(super) skipped: usize,
    pub(super) voxels: usize,
    pub(super) resolution_m: f64,
    pub(super) levels: u32,
    pub(super) seconds: f64,
    pub(super) error: Option<ErrorSummary>,
    pub(super) filter: Option<FilterSummary>,
}

impl Serialize for Summary {
    /// As `{"summary": {...}}`, to be told from a scan.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let summary = serde_json::json!({
            "summary": {
                "scans": self.scans,
                "accepted": self.accepted,
                "refused": self.refused,
                "skipped": self.skipped,
                "voxels": self.voxels,
                "seconds": self.seconds,
                "error_m": self.error.map(|error| error.meters),
                "error_deg": self.error.map(|error| error.degrees),
                "filter": self.filter,
            }
        });
        summary.serialize(serializer)
    }
}

impl Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "\n{} scans, {} accepted, {} refused{}: {} voxels of {} m, {} levels, in {:.1} s",
            self.scans,
            self.accepted,
            self.refused,
            if self.skipped > 0 { format!(", {} skipped", self.skipped) } else { String::new() },
            count(self.voxels),
            self.resolution_m,
            self.levels,
            self.seconds
        )?;
        if let Some(error) = &self.error {
            write!(f, "\n{error}")?;
        }
        self.filter.iter().try_for_each(|filter| write!(f, "\n{filter}"))
    }
}
