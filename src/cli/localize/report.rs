//! Output of `mrol localize` for a scan.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use crate::cli::scan_report::{PLACE_HEAD, place};
use mrol::json::{JsonLocalization, JsonPose, JsonRival};
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
            write!(f, "\n  {PLACE_HEAD}      qx      qy      qz      qw  overlap  agreement  evidence")?;
        }
        for candidate in &answer.candidates {
            write!(f, "\n  {}  {:>7.3}", pose(&candidate.map_from_sensor), candidate.overlap)?;
            match &candidate.rays {
                Some(rays) => write!(f, "  {:>9.3}  {:>8.3}", rays.agreement, rays.evidence)?,
                None => write!(f, "  {:>9}  {:>8}", "-", "-")?,
            }
        }
        if !answer.rivals.is_empty() {
            write!(f, "\n  as likely:")?;
        }
        for JsonRival { map_from_sensor, rays } in &answer.rivals {
            write!(f, "\n  {}  {:>7}", pose(map_from_sensor), "")?;
            write!(f, "  {:>9.3}  {:>8.3}", rays.agreement, rays.evidence)?;
        }
        Ok(())
    }
}

/// A pose as columns: place, then rotation.
fn pose(pose: &JsonPose) -> String {
    let [qx, qy, qz, qw] = pose.rotation_xyzw;
    format!("{}  {qx:>6.3}  {qy:>6.3}  {qz:>6.3}  {qw:>6.3}", place(pose))
}
