//! `POST /v1/maps/{map}/scans` and `/alignment`: insert a scan, or only align it.

use axum::extract::State;
use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::Adapter;
use super::body::Points;
use super::error::HttpError;
use super::json::{JsonPoints, JsonPose, JsonState};
use super::parameters::{self, Map};
use crate::align::Guess;
use crate::geometry::Pose;
use crate::map::RobotName;
use crate::service::{PointCloud, ScanAnswer, ScanRequest, ServiceError};
use crate::wire::InField;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScanJson {
    robot: String,
    scan_id: Option<u64>,
    points: JsonPoints,
    timestamp_ns: Option<i64>,
    guess: Option<JsonPose>,
    motion: Option<JsonPose>,
    #[serde(default = "yes")]
    align: bool,
    #[serde(default)]
    strict: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScanQuery {
    robot: String,
    scan_id: Option<u64>,
    timestamp_ns: Option<i64>,
    guess: Option<String>,
    motion: Option<String>,
    #[serde(default = "yes")]
    align: bool,
    #[serde(default)]
    strict: bool,
}

type ScanBody = Points<ScanJson, ScanQuery>;

#[derive(Serialize)]
pub(super) struct ScanOut {
    accepted: bool,
    verdict: &'static str,
    map_from_sensor: JsonPose,
    overlap: f64,
    level_overlaps: Vec<f64>,
    iterations: u32,
    new_voxels: usize,
    points_skipped: usize,
    replayed: bool,
    #[serde(flatten)]
    state: JsonState,
}

pub(super) async fn insert(
    State(adapter): State<Adapter>,
    Map(map): Map,
    scan: ScanBody,
) -> Result<Json<ScanOut>, HttpError> {
    let answer = adapter.service.insert_scan(&map, scan.try_into()?).await?;
    Ok(Json(answer.into()))
}

pub(super) async fn align(
    State(adapter): State<Adapter>,
    Map(map): Map,
    scan: ScanBody,
) -> Result<Json<ScanOut>, HttpError> {
    let answer = adapter.service.maps().align_scan(&map, scan.try_into()?).await?;
    Ok(Json(answer.into()))
}

impl TryFrom<ScanBody> for ScanRequest {
    type Error = ServiceError;

    fn try_from(body: ScanBody) -> Result<Self, ServiceError> {
        match body {
            Points::Json(scan) => scan.try_into(),
            Points::Bytes(points, rest) => rest.with(points),
        }
    }
}

impl TryFrom<ScanJson> for ScanRequest {
    type Error = ServiceError;

    fn try_from(scan: ScanJson) -> Result<Self, ServiceError> {
        let guess = scan.guess.map(|pose| Pose::try_from(pose).in_field("guess")).transpose()?;
        let motion = scan.motion.map(|pose| Pose::try_from(pose).in_field("motion")).transpose()?;
        Ok(Self {
            robot: RobotName::new(&scan.robot)?,
            scan_id: scan.scan_id,
            points: scan.points.into(),
            timestamp_ns: scan.timestamp_ns,
            guess: guess_of(guess, motion)?,
            at_guess: !scan.align,
            strict: scan.strict,
        })
    }
}

impl ScanQuery {
    fn with(self, points: PointCloud) -> Result<ScanRequest, ServiceError> {
        let pose = |text: Option<String>, field| text.map(|text| parameters::pose(&text, field)).transpose();
        Ok(ScanRequest {
            robot: RobotName::new(&self.robot)?,
            scan_id: self.scan_id,
            points,
            timestamp_ns: self.timestamp_ns,
            guess: guess_of(pose(self.guess, "guess")?, pose(self.motion, "motion")?)?,
            at_guess: !self.align,
            strict: self.strict,
        })
    }
}

fn guess_of(guess: Option<Pose>, motion: Option<Pose>) -> Result<Guess, ServiceError> {
    match (guess, motion) {
        (None, None) => Ok(Guess::Last),
        (Some(map_from_sensor), None) => Ok(Guess::Pose(map_from_sensor)),
        (None, Some(last_from_sensor)) => Ok(Guess::Motion(last_from_sensor)),
        (Some(_), Some(_)) => {
            Err(ServiceError::invalid("ambiguous_guess", "one of guess and motion can be given, got both"))
        }
    }
}

impl From<ScanAnswer> for ScanOut {
    fn from(answer: ScanAnswer) -> Self {
        Self {
            accepted: answer.accepted(),
            verdict: answer.verdict.as_str(),
            map_from_sensor: (&answer.map_from_sensor).into(),
            overlap: answer.overlap(),
            iterations: answer.iterations,
            new_voxels: answer.new_voxels,
            points_skipped: answer.points_skipped,
            replayed: answer.replayed,
            state: answer.state.into(),
            level_overlaps: answer.level_overlaps,
        }
    }
}

fn yes() -> bool {
    true
}
