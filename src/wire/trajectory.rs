//! Trajectories (`mapping.proto`).

use super::types::count_from;
use super::{InField, pb, required};
use crate::map::{MapName, RobotName, TrajectoryPose};
use crate::service::{ServiceError, TrajectoryAnswer};

impl TryFrom<pb::GetTrajectoryRequest> for (MapName, Option<RobotName>) {
    type Error = ServiceError;

    fn try_from(request: pb::GetTrajectoryRequest) -> Result<Self, ServiceError> {
        let robot = (!request.robot.is_empty()).then(|| RobotName::new(&request.robot)).transpose()?;
        Ok((MapName::new(&request.map)?, robot))
    }
}

impl From<(&MapName, Option<&RobotName>)> for pb::GetTrajectoryRequest {
    fn from((map, robot): (&MapName, Option<&RobotName>)) -> Self {
        Self { map: map.to_string(), robot: robot.map(ToString::to_string).unwrap_or_default() }
    }
}

impl From<TrajectoryAnswer> for pb::GetTrajectoryResponse {
    fn from(answer: TrajectoryAnswer) -> Self {
        Self { poses: answer.poses.iter().map(Into::into).collect(), state: Some(answer.state.into()) }
    }
}

impl From<&TrajectoryPose> for pb::TrajectoryPose {
    fn from(pose: &TrajectoryPose) -> Self {
        Self {
            robot: pose.robot.to_string(),
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: Some((&pose.map_from_sensor).into()),
            revision: pose.revision,
            overlap: pose.overlap(),
            new_voxels: pose.new_voxels as u64,
        }
    }
}

impl TryFrom<pb::GetTrajectoryResponse> for TrajectoryAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::GetTrajectoryResponse) -> Result<Self, ServiceError> {
        Ok(Self {
            poses: answer.poses.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            state: required(answer.state, "state")?.try_into()?,
        })
    }
}

/// What the wire leaves out (overlaps above level 0, iterations, skipped points, the digest) is zero or empty.
impl TryFrom<pb::TrajectoryPose> for TrajectoryPose {
    type Error = ServiceError;

    fn try_from(pose: pb::TrajectoryPose) -> Result<Self, ServiceError> {
        let map_from_sensor = required(pose.map_from_sensor, "poses.map_from_sensor")?;
        Ok(Self {
            robot: RobotName::new(&pose.robot)?,
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: map_from_sensor.try_into().in_field("poses.map_from_sensor")?,
            revision: pose.revision,
            level_overlaps: vec![pose.overlap],
            iterations: 0,
            points_skipped: 0,
            new_voxels: count_from(pose.new_voxels),
            digest: 0,
        })
    }
}
