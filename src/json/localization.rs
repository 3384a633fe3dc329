//! The answer to a localization in JSON.

use serde::Serialize;
use utoipa::ToSchema;

use super::agreement::{JsonRayAgreement, JsonRival};
use super::described;
use super::pose::JsonPose;
use super::version::JsonVersion;
use mrol_service::{CandidateAnswer, LocalizationAnswer};

/// Where a scan was found.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Localization)]
pub struct JsonLocalization {
    /// True where the scan was found.
    pub accepted: bool,
    /// The search's verdict.
    #[schema(value_type = described::Verdict)]
    pub verdict: &'static str,
    /// Why, in a sentence.
    pub reason: String,
    /// The places found, best first: that of the verdict, then those of which rays tell enough, by the share that
    /// agree, then the others, by overlap.
    pub candidates: Vec<JsonCandidate>,
    /// Poses that the scan may have been taken at as well as at the first candidate: why it is ambiguous.
    pub rivals: Vec<JsonRival>,
    /// True where the whole map was searched.
    pub exhaustive: bool,
    /// True of a search whose time was up.
    pub cut_short: bool,
    /// Time of the search, milliseconds.
    pub search_ms: f64,
    /// Points that were left out.
    pub points_skipped: usize,
    /// The version of the map that was searched.
    #[serde(flatten)]
    pub version: JsonVersion,
}

/// A place where a scan may have been taken.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Candidate)]
pub struct JsonCandidate {
    /// The pose of the sensor in the map.
    pub map_from_sensor: JsonPose,
    /// Fraction of the points in occupied voxels of the finest level.
    pub overlap: f64,
    /// Fraction of a sample of the points that lie on the map's surfaces.
    pub inliers: f64,
    /// How rays agree there; null where the search was stopped before they were asked.
    pub rays: Option<JsonRayAgreement>,
}

impl From<LocalizationAnswer> for JsonLocalization {
    fn from(answer: LocalizationAnswer) -> Self {
        Self {
            accepted: answer.accepted(),
            verdict: answer.verdict.as_str(),
            reason: answer.reason,
            candidates: answer.candidates.iter().map(JsonCandidate::from).collect(),
            rivals: answer.rivals.into_iter().map(Into::into).collect(),
            exhaustive: answer.exhaustive,
            cut_short: answer.cut_short,
            search_ms: answer.search_time.as_secs_f64() * 1e3,
            points_skipped: answer.points_skipped,
            version: answer.version.into(),
        }
    }
}

impl From<&CandidateAnswer> for JsonCandidate {
    fn from(candidate: &CandidateAnswer) -> Self {
        Self {
            map_from_sensor: (&candidate.map_from_sensor).into(),
            overlap: candidate.overlap,
            inliers: candidate.inliers,
            rays: candidate.rays.map(Into::into),
        }
    }
}
