//! What became of a scan in JSON.

use serde::Serialize;
use utoipa::ToSchema;

use super::pose::JsonPose;
use super::scan::JsonScan;
use super::vectors::Vector3;
use mrol_service::{FailedScan, ScanAnswer, ScanEvent};

/// What became of a scan that was sent for insertion.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ScanEvent)]
pub struct JsonEvent {
    /// Greater than that of every event of the map before it.
    pub number: u64,
    /// When it was answered, milliseconds since the Unix epoch.
    pub time_ms: f64,
    /// The robot that sent it.
    pub robot: String,
    /// The run of the robot's software.
    pub session: String,
    /// The robot's own number of it.
    pub scan_id: Option<u64>,
    /// Its points, whether they counted or not.
    pub points: usize,
    /// From the whole request to its answer, milliseconds.
    pub duration_ms: f64,
    /// The pose that its guess stood for; null of a request that failed, and of an answer that is given again.
    pub guess: Option<JsonPose>,
    /// Of a robot's last scan, where it was refused: some of its points, in the sensor frame.
    #[schema(value_type = Vec<Vector3>, required = false)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sample: Vec<[f32; 3]>,
    /// What was answered; null of a request that failed.
    pub answer: Option<JsonScan>,
    /// Why the request failed; null of one that was answered.
    pub error: Option<JsonFailure>,
}

/// Why a request failed.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = FailedScan)]
pub struct JsonFailure {
    /// The stable word for programs.
    pub reason: String,
    /// A sentence for people.
    pub detail: String,
}

impl From<&ScanEvent> for JsonEvent {
    fn from(event: &ScanEvent) -> Self {
        let (answer, error) = match &event.answer {
            Ok(answer) => (Some(ScanAnswer::clone(answer).into()), None),
            Err(error) => (None, Some(error.into())),
        };
        Self {
            number: event.number,
            time_ms: event.time_ns as f64 / 1e6,
            robot: event.robot.to_string(),
            session: event.session.to_string(),
            scan_id: event.scan_id,
            points: event.points,
            duration_ms: event.duration.as_secs_f64() * 1e3,
            guess: event.guess.as_ref().map(Into::into),
            sample: event.sample.iter().map(|point| point.xyz()).collect(),
            answer,
            error,
        }
    }
}

impl From<&FailedScan> for JsonFailure {
    fn from(FailedScan { reason, message }: &FailedScan) -> Self {
        Self { reason: reason.to_string(), detail: message.clone() }
    }
}
