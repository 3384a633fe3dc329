//! Trajectories (`mapping.proto`).

use super::pb;
use super::values::{InField, count_from, required};
use mrol_map::map::{MapName, MappedScan, RobotName, SessionName};
use mrol_service::{ServiceError, TrajectoryAnswer, TrajectoryQuery};

impl TryFrom<pb::GetTrajectoryRequest> for (MapName, TrajectoryQuery) {
    type Error = ServiceError;

    fn try_from(request: pb::GetTrajectoryRequest) -> Result<Self, ServiceError> {
        let pb::GetTrajectoryRequest { map, robot, since_revision, limit } = request;
        let limit = (limit > 0).then(|| count_from(limit));
        Ok((MapName::new(&map)?, TrajectoryQuery { robot: robot_of(&robot)?, since_revision, limit }))
    }
}

impl TryFrom<pb::StreamTrajectoryRequest> for (MapName, TrajectoryQuery) {
    type Error = ServiceError;

    fn try_from(request: pb::StreamTrajectoryRequest) -> Result<Self, ServiceError> {
        let pb::StreamTrajectoryRequest { map, robot, since_revision } = request;
        Ok((MapName::new(&map)?, TrajectoryQuery { robot: robot_of(&robot)?, since_revision, limit: None }))
    }
}

/// The robot of that name; every robot where it is empty.
fn robot_of(name: &str) -> Result<Option<RobotName>, ServiceError> {
    Ok((!name.is_empty()).then(|| RobotName::new(name)).transpose()?)
}

impl From<(&MapName, TrajectoryQuery)> for pb::GetTrajectoryRequest {
    fn from((map, query): (&MapName, TrajectoryQuery)) -> Self {
        let TrajectoryQuery { robot, since_revision, limit } = query;
        let robot = robot.map(|robot| robot.to_string()).unwrap_or_default();
        Self { map: map.to_string(), robot, since_revision, limit: limit.unwrap_or_default() as u64 }
    }
}

/// The request for a stream, of which nobody limits the poses.
impl From<(&MapName, TrajectoryQuery)> for pb::StreamTrajectoryRequest {
    fn from(request: (&MapName, TrajectoryQuery)) -> Self {
        let pb::GetTrajectoryRequest { map, robot, since_revision, .. } = request.into();
        Self { map, robot, since_revision }
    }
}

impl From<TrajectoryAnswer> for pb::GetTrajectoryResponse {
    fn from(answer: TrajectoryAnswer) -> Self {
        Self {
            poses: answer.poses.iter().map(Into::into).collect(),
            version: Some(answer.version.into()),
            next_since_revision: answer.next_since_revision,
        }
    }
}

impl From<TrajectoryAnswer> for pb::StreamTrajectoryResponse {
    fn from(piece: TrajectoryAnswer) -> Self {
        Self { poses: piece.poses.iter().map(Into::into).collect(), version: Some(piece.version.into()) }
    }
}

impl From<&MappedScan> for pb::TrajectoryPose {
    fn from(pose: &MappedScan) -> Self {
        Self {
            robot: pose.robot.to_string(),
            session: pose.session.to_string(),
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: Some((&pose.map_from_sensor).into()),
            revision: pose.revision,
            overlap: pose.overlap(),
            new_voxels: pose.new_voxels as u64,
            carved_voxels: pose.carved_voxels as u64,
        }
    }
}

impl TryFrom<pb::GetTrajectoryResponse> for TrajectoryAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::GetTrajectoryResponse) -> Result<Self, ServiceError> {
        Ok(Self {
            poses: answer.poses.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            next_since_revision: answer.next_since_revision,
            version: required(answer.version, "version")?.try_into()?,
        })
    }
}

impl TryFrom<pb::StreamTrajectoryResponse> for TrajectoryAnswer {
    type Error = ServiceError;

    fn try_from(piece: pb::StreamTrajectoryResponse) -> Result<Self, ServiceError> {
        let pb::StreamTrajectoryResponse { poses, version } = piece;
        pb::GetTrajectoryResponse { poses, version, next_since_revision: None }.try_into()
    }
}

/// What the wire leaves out (overlaps above level 0, iterations, skipped points, the digest) is zero or empty.
impl TryFrom<pb::TrajectoryPose> for MappedScan {
    type Error = ServiceError;

    fn try_from(pose: pb::TrajectoryPose) -> Result<Self, ServiceError> {
        let map_from_sensor = required(pose.map_from_sensor, "poses.map_from_sensor")?;
        Ok(Self {
            robot: RobotName::new(&pose.robot)?,
            session: SessionName::new(&pose.session)?,
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: map_from_sensor.try_into().in_field("poses.map_from_sensor")?,
            revision: pose.revision,
            level_overlaps: vec![pose.overlap],
            iterations: 0,
            points_skipped: 0,
            new_voxels: count_from(pose.new_voxels),
            carved_voxels: count_from(pose.carved_voxels),
            digest: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_for_a_page_comes_back() {
        let robot = Some(RobotName::new("r").unwrap());
        for query in
            [TrajectoryQuery::default(), TrajectoryQuery { robot, since_revision: u64::MAX, limit: Some(7) }]
        {
            let map = MapName::new("a").unwrap();
            let request = pb::GetTrajectoryRequest::from((&map, query.clone()));
            assert_eq!(<(MapName, TrajectoryQuery)>::try_from(request).unwrap(), (map, query));
        }
    }
}
