//! Searches for a scan's place (`mapping.proto`).

use std::time::Duration;

use super::pb;
use super::scan::verdict_from;
use super::values::{InField, count_from, required};
use mrol_map::align::Rival;
use mrol_map::align::localize::{Gravity, LocalizationQuery, MAP_DOWN, SearchBox};
use mrol_map::map::MapName;
use mrol_service::{CandidateAnswer, LocalizationAnswer, LocalizationRequest, ServiceError};

impl TryFrom<pb::LocalizeRequest> for (MapName, LocalizationRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::LocalizeRequest) -> Result<Self, ServiceError> {
        let query = LocalizationQuery {
            gravity: request.gravity.map(gravity_from).transpose()?,
            search_box: request.search_box.map(box_from).transpose()?,
            candidates: request.candidates as usize,
            seed: request.seed,
        };
        let scan = LocalizationRequest {
            points: required(request.points, "points")?.try_into().in_field("points")?,
            query,
            time_limit: request.time_limit_s.map(LocalizationRequest::time_limit_of).transpose()?,
        };
        Ok((MapName::new(&request.map)?, scan))
    }
}

fn gravity_from(gravity: pb::Gravity) -> Result<Gravity, ServiceError> {
    let in_sensor = required(gravity.in_sensor, "gravity.in_sensor")?;
    Ok(Gravity::new(in_sensor.into(), gravity.in_map.map_or(MAP_DOWN, Into::into))?)
}

fn box_from(search_box: pb::Box) -> Result<SearchBox, ServiceError> {
    let min_m = required(search_box.min_m, "search_box.min_m")?;
    let max_m = required(search_box.max_m, "search_box.max_m")?;
    Ok(SearchBox::new(min_m.into(), max_m.into())?)
}

impl From<(&MapName, LocalizationRequest)> for pb::LocalizeRequest {
    fn from((map, scan): (&MapName, LocalizationRequest)) -> Self {
        let LocalizationQuery { gravity, search_box, candidates, seed } = scan.query;
        Self {
            map: map.to_string(),
            points: Some(scan.points.into()),
            gravity: gravity.map(|gravity| pb::Gravity {
                in_sensor: Some(gravity.in_sensor().into()),
                in_map: Some(gravity.in_map().into()),
            }),
            search_box: search_box.map(|search_box| pb::Box {
                min_m: Some(search_box.min_m().into()),
                max_m: Some(search_box.max_m().into()),
            }),
            time_limit_s: scan.time_limit.map(|limit| limit.as_secs_f64()),
            candidates: u32::try_from(candidates).unwrap_or(u32::MAX),
            seed,
        }
    }
}

impl From<LocalizationAnswer> for pb::LocalizeResponse {
    fn from(answer: LocalizationAnswer) -> Self {
        Self {
            accepted: answer.accepted(),
            verdict: pb::Verdict::from(answer.verdict).into(),
            reason: answer.reason,
            candidates: answer.candidates.into_iter().map(Into::into).collect(),
            rivals: answer.rivals.iter().map(Into::into).collect(),
            exhaustive: answer.exhaustive,
            cut_short: answer.cut_short,
            search_ms: answer.search_time.as_secs_f64() * 1e3,
            points_skipped: answer.points_skipped as u64,
            version: Some(answer.version.into()),
        }
    }
}

impl From<CandidateAnswer> for pb::Candidate {
    fn from(candidate: CandidateAnswer) -> Self {
        Self {
            map_from_sensor: Some((&candidate.map_from_sensor).into()),
            overlap: candidate.overlap,
            inliers: candidate.inliers,
            rays: candidate.rays.map(Into::into),
        }
    }
}

impl TryFrom<pb::LocalizeResponse> for LocalizationAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::LocalizeResponse) -> Result<Self, ServiceError> {
        let search_time = Duration::try_from_secs_f64(answer.search_ms / 1e3).unwrap_or_default();
        Ok(Self {
            verdict: verdict_from(answer.verdict).in_field("verdict")?,
            reason: answer.reason,
            candidates: answer.candidates.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            rivals: answer
                .rivals
                .into_iter()
                .map(Rival::try_from)
                .collect::<Result<_, _>>()
                .in_field("rivals")?,
            exhaustive: answer.exhaustive,
            cut_short: answer.cut_short,
            search_time,
            points_skipped: count_from(answer.points_skipped),
            version: required(answer.version, "version")?.try_into()?,
        })
    }
}

impl TryFrom<pb::Candidate> for CandidateAnswer {
    type Error = ServiceError;

    fn try_from(candidate: pb::Candidate) -> Result<Self, ServiceError> {
        let map_from_sensor = required(candidate.map_from_sensor, "candidates.map_from_sensor")?;
        Ok(Self {
            map_from_sensor: map_from_sensor.try_into().in_field("candidates.map_from_sensor")?,
            overlap: candidate.overlap,
            inliers: candidate.inliers,
            rays: candidate.rays.map(Into::into),
        })
    }
}
