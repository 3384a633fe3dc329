//! Output of `mrol localize` for a scan.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use crate::cli::scan_report::{PLACE_HEAD, place};
use mrol::json::JsonLocalization;
use mrol_service::LocalizationAnswer;

#[derive(Serialize)]
pub(super) struct Localized {
    scan: String,
    #[serde(flatten)]
    answer: JsonLocalization,
}

impl Localized {
    pub(super) fn of(scan: String, answer: &LocalizationAnswer) -> Self {
        Self { scan, answer: answer.clone().into() }
    }
}

impl Display for Localized {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scan, answer } = self;
        let how = match (answer.exhaustive, answer.cut_short) {
            (_, true) => "cut short",
            (true, _) => "exhaustive",
            (false, false) => "not exhaustive",
        };
        let seconds = answer.search_ms / 1e3;
        write!(f, "{}: {}: {} ({seconds:.2} s, {how})", scan, answer.verdict, answer.reason)?;
        if !answer.candidates.is_empty() {
            write!(f, "\n  {PLACE_HEAD}      qx      qy      qz      qw  overlap  blocked     fit   margin")?;
        }
        for candidate in &answer.candidates {
            let [qx, qy, qz, qw] = candidate.map_from_sensor.rotation_xyzw;
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
