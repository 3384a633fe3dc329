//! `GET /v1/maps/{map}/trajectory`: the poses of the accepted scans, of all robots or of `?robot=`.

use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::around::Service;
use super::error::HttpError;
use super::json::{JsonPose, JsonState};
use super::parameters::{Map, Parameters};
use crate::map::{RobotName, TrajectoryPose};
use crate::service::{ServiceError, TrajectoryAnswer};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrajectoryQuery {
    robot: Option<String>,
}

#[derive(Serialize)]
pub(super) struct TrajectoryOut {
    poses: Vec<PoseOut>,
    #[serde(flatten)]
    state: JsonState,
}

#[derive(Serialize)]
struct PoseOut {
    robot: String,
    scan_id: Option<u64>,
    timestamp_ns: Option<i64>,
    map_from_sensor: JsonPose,
    revision: u64,
    overlap: f64,
    new_voxels: usize,
}

pub(super) async fn get(
    Service(service): Service,
    Map(map): Map,
    Parameters(query): Parameters<TrajectoryQuery>,
) -> Result<Json<TrajectoryOut>, HttpError> {
    let robot = query.robot.map(|name| RobotName::new(&name)).transpose().map_err(ServiceError::from)?;
    let answer = service.maps().trajectory(&map, robot.as_ref()).await?;
    Ok(Json(answer.into()))
}

impl From<TrajectoryAnswer> for TrajectoryOut {
    fn from(answer: TrajectoryAnswer) -> Self {
        Self { poses: answer.poses.iter().map(Into::into).collect(), state: answer.state.into() }
    }
}

impl From<&TrajectoryPose> for PoseOut {
    fn from(pose: &TrajectoryPose) -> Self {
        Self {
            robot: pose.robot.to_string(),
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: (&pose.map_from_sensor).into(),
            revision: pose.revision,
            overlap: pose.overlap(),
            new_voxels: pose.new_voxels,
        }
    }
}
