//! Scans and what becomes of them (`mapping.proto`).

use super::types::count_from;
use super::{InField, pb, required};
use crate::align::{Guess, Verdict};
use crate::map::{MapName, RobotName};
use crate::service::{ScanAnswer, ScanRequest, ServiceError};

impl TryFrom<pb::InsertScanRequest> for (MapName, ScanRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::InsertScanRequest) -> Result<Self, ServiceError> {
        let scan = scan_from(request.scan, request.guess, request.at_guess)?;
        Ok((MapName::new(&request.map)?, scan))
    }
}

impl TryFrom<pb::AlignScanRequest> for (MapName, ScanRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::AlignScanRequest) -> Result<Self, ServiceError> {
        let scan = scan_from(request.scan, request.guess, request.at_guess)?;
        Ok((MapName::new(&request.map)?, scan))
    }
}

fn scan_from(
    scan: Option<pb::Scan>,
    guess: Option<pb::Guess>,
    at_guess: bool,
) -> Result<ScanRequest, ServiceError> {
    let scan = required(scan, "scan")?;
    Ok(ScanRequest {
        robot: RobotName::new(&scan.robot).in_field("scan.robot")?,
        scan_id: scan.scan_id,
        points: required(scan.points, "scan.points")?.try_into().in_field("scan.points")?,
        timestamp_ns: scan.timestamp_ns,
        guess: guess_from(guess)?,
        at_guess,
        strict: scan.strict,
    })
}

fn guess_from(guess: Option<pb::Guess>) -> Result<Guess, ServiceError> {
    let Some(guess) = guess else { return Ok(Guess::Last) };
    match required(guess.kind, "guess.kind")? {
        pb::guess::Kind::MapFromSensor(pose) => {
            Ok(Guess::Pose(pose.try_into().in_field("guess.map_from_sensor")?))
        }
        pb::guess::Kind::LastFromSensor(motion) => {
            Ok(Guess::Motion(motion.try_into().in_field("guess.last_from_sensor")?))
        }
    }
}

impl From<&Guess> for Option<pb::Guess> {
    fn from(guess: &Guess) -> Self {
        let kind = match guess {
            Guess::Last => return None,
            Guess::Pose(pose) => pb::guess::Kind::MapFromSensor(pose.into()),
            Guess::Motion(motion) => pb::guess::Kind::LastFromSensor(motion.into()),
        };
        Some(pb::Guess { kind: Some(kind) })
    }
}

impl From<ScanRequest> for pb::Scan {
    fn from(scan: ScanRequest) -> Self {
        Self {
            robot: scan.robot.to_string(),
            scan_id: scan.scan_id,
            points: Some(scan.points.into()),
            timestamp_ns: scan.timestamp_ns,
            strict: scan.strict,
        }
    }
}

impl From<(&MapName, ScanRequest)> for pb::InsertScanRequest {
    fn from((map, scan): (&MapName, ScanRequest)) -> Self {
        let (guess, at_guess) = ((&scan.guess).into(), scan.at_guess);
        Self { map: map.to_string(), scan: Some(scan.into()), guess, at_guess }
    }
}

impl From<(&MapName, ScanRequest)> for pb::AlignScanRequest {
    fn from((map, scan): (&MapName, ScanRequest)) -> Self {
        let (guess, at_guess) = ((&scan.guess).into(), scan.at_guess);
        Self { map: map.to_string(), scan: Some(scan.into()), guess, at_guess }
    }
}

impl From<Verdict> for pb::Verdict {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Accepted => Self::Accepted,
            Verdict::LowOverlap => Self::LowOverlap,
        }
    }
}

fn verdict_from(number: i32) -> Result<Verdict, ServiceError> {
    match pb::Verdict::try_from(number) {
        Ok(pb::Verdict::Accepted) => Ok(Verdict::Accepted),
        Ok(pb::Verdict::LowOverlap) => Ok(Verdict::LowOverlap),
        Ok(pb::Verdict::Unspecified) | Err(_) => {
            let message = format!("alignment.verdict must be 1 or 2, got {number}");
            Err(ServiceError::invalid("bad_verdict", message))
        }
    }
}

impl From<&ScanAnswer> for pb::Alignment {
    fn from(answer: &ScanAnswer) -> Self {
        Self {
            verdict: pb::Verdict::from(answer.verdict).into(),
            map_from_sensor: Some((&answer.map_from_sensor).into()),
            overlap: answer.overlap(),
            level_overlaps: answer.level_overlaps.clone(),
            iterations: answer.iterations,
            points_skipped: answer.points_skipped as u64,
        }
    }
}

impl From<ScanAnswer> for pb::InsertScanResponse {
    fn from(answer: ScanAnswer) -> Self {
        Self {
            accepted: answer.accepted(),
            alignment: Some((&answer).into()),
            new_voxels: answer.new_voxels as u64,
            state: Some(answer.state.into()),
            replayed: answer.replayed,
        }
    }
}

impl From<ScanAnswer> for pb::AlignScanResponse {
    fn from(answer: ScanAnswer) -> Self {
        Self {
            accepted: answer.accepted(),
            alignment: Some((&answer).into()),
            state: Some(answer.state.into()),
        }
    }
}

impl TryFrom<pb::InsertScanResponse> for ScanAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::InsertScanResponse) -> Result<Self, ServiceError> {
        let judged = pb::AlignScanResponse {
            accepted: answer.accepted,
            alignment: answer.alignment,
            state: answer.state,
        };
        let judged = Self::try_from(judged)?;
        Ok(Self { new_voxels: count_from(answer.new_voxels), replayed: answer.replayed, ..judged })
    }
}

impl TryFrom<pb::AlignScanResponse> for ScanAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::AlignScanResponse) -> Result<Self, ServiceError> {
        let alignment = required(answer.alignment, "alignment")?;
        let map_from_sensor = required(alignment.map_from_sensor, "alignment.map_from_sensor")?;
        Ok(Self {
            verdict: verdict_from(alignment.verdict)?,
            map_from_sensor: map_from_sensor.try_into().in_field("alignment.map_from_sensor")?,
            level_overlaps: alignment.level_overlaps,
            iterations: alignment.iterations,
            points_skipped: count_from(alignment.points_skipped),
            new_voxels: 0,
            state: required(answer.state, "state")?.try_into()?,
            replayed: false,
        })
    }
}
