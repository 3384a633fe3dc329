//! What `mrol localize` prints of a scan.

use std::fmt::{self, Display};

use serde::Serialize;

use super::super::scan_report::{PLACE_HEAD, place, seven};
use crate::service::{CandidateAnswer, LocalizationAnswer};

#[derive(Serialize)]
pub(super) struct Localized {
    scan: String,
    accepted: bool,
    verdict: &'static str,
    reason: String,
    candidates: Vec<CandidateLine>,
    exhaustive: bool,
    cut_short: bool,
    search_ms: f64,
    points_skipped: usize,
    revision: u64,
    map_uuid: String,
}

#[derive(Serialize)]
struct CandidateLine {
    map_from_sensor: [f64; 7],
    overlap: f64,
    inliers: f64,
    blocked: f64,
    fit: f64,
    margin: Option<f64>,
}

impl Localized {
    pub(super) fn of(scan: String, answer: &LocalizationAnswer) -> Self {
        Self {
            scan,
            accepted: answer.accepted(),
            verdict: answer.verdict.as_str(),
            reason: answer.reason.clone(),
            candidates: answer.candidates.iter().map(CandidateLine::from).collect(),
            exhaustive: answer.exhaustive,
            cut_short: answer.cut_short,
            search_ms: answer.search_time.as_secs_f64() * 1e3,
            points_skipped: answer.points_skipped,
            revision: answer.version.revision,
            map_uuid: answer.version.map_uuid.to_string(),
        }
    }
}

impl From<&CandidateAnswer> for CandidateLine {
    fn from(candidate: &CandidateAnswer) -> Self {
        Self {
            map_from_sensor: seven(&candidate.map_from_sensor),
            overlap: candidate.overlap,
            inliers: candidate.inliers,
            blocked: candidate.blocked,
            fit: candidate.fit,
            margin: candidate.margin,
        }
    }
}

impl Display for Localized {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how = match (self.exhaustive, self.cut_short) {
            (_, true) => "cut short",
            (true, _) => "exhaustive",
            (false, false) => "not exhaustive",
        };
        let seconds = self.search_ms / 1e3;
        write!(f, "{}: {}: {} ({seconds:.2} s, {how})", self.scan, self.verdict, self.reason)?;
        if !self.candidates.is_empty() {
            write!(f, "\n  {PLACE_HEAD}      qx      qy      qz      qw  overlap  blocked     fit   margin")?;
        }
        for candidate in &self.candidates {
            let [.., qx, qy, qz, qw] = candidate.map_from_sensor;
            let margin = candidate.margin.map_or_else(|| "-".into(), |margin| format!("{margin:.3}"));
            write!(
                f,
                "\n  {}  {qx:>6.3}  {qy:>6.3}  {qz:>6.3}  {qw:>6.3}  {:>7.3}  {:>7.3}  {:>6.3}  {margin:>7}",
                place(&candidate.map_from_sensor),
                candidate.overlap,
                candidate.blocked,
                candidate.fit,
            )?;
        }
        Ok(())
    }
}
