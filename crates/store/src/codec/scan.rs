//! Encoding of scans: their poses, and their voxels.

use super::moments;
use super::unreadable::{Unreadable, count, required};
use crate::pb;
use mrol_map::geometry::{self, Pose, rotation_xyzw, translation_m};
use mrol_map::map::{
    ForgottenIds, ID_RANGES_PER_SESSION_MAX, MappedScan, RobotName, ScanRecord, SessionName, Trajectory,
    WithdrawnChange,
};
use mrol_map::util::StopSignal;
use mrol_map::voxel::VoxelSet;

impl From<&MappedScan> for pb::ScanPose {
    fn from(pose: &MappedScan) -> Self {
        Self {
            robot: pose.robot.as_str().to_owned(),
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: pose_numbers(&pose.map_from_sensor),
            revision: pose.revision,
            level_overlaps: pose.level_overlaps.clone(),
            iterations: pose.iterations,
            points_skipped: pose.points_skipped as u64,
            new_voxels: pose.new_voxels as u64,
            carved_voxels: pose.carved_voxels as u64,
            digest: pose.digest,
            session: pose.session.as_str().to_owned(),
        }
    }
}

impl TryFrom<pb::ScanPose> for MappedScan {
    type Error = Unreadable;

    fn try_from(message: pb::ScanPose) -> Result<Self, Unreadable> {
        Ok(Self {
            robot: RobotName::new(&message.robot).map_err(|e| e.to_string())?,
            session: SessionName::new(&message.session).map_err(|e| e.to_string())?,
            scan_id: message.scan_id,
            timestamp_ns: message.timestamp_ns,
            map_from_sensor: pose_from(&message.map_from_sensor)?,
            revision: message.revision,
            level_overlaps: message.level_overlaps,
            iterations: message.iterations,
            points_skipped: count(message.points_skipped),
            new_voxels: count(message.new_voxels),
            carved_voxels: count(message.carved_voxels),
            digest: message.digest,
        })
    }
}

/// A pose as x y z qx qy qz qw.
pub(super) fn pose_numbers(pose: &Pose) -> Vec<f64> {
    [&translation_m(pose)[..], &rotation_xyzw(pose)].concat()
}

/// The inverse of [`pose_numbers`].
pub(super) fn pose_from(numbers: &[f64]) -> Result<Pose, Unreadable> {
    let [x, y, z, qx, qy, qz, qw] = *numbers else {
        return Err(format!("a pose of {} numbers instead of 7", numbers.len()));
    };
    geometry::pose([x, y, z], [qx, qy, qz, qw]).map_err(|e| e.to_string())
}

impl From<&ScanRecord> for pb::Insertion {
    fn from(scan: &ScanRecord) -> Self {
        Self {
            pose: Some((&scan.pose).into()),
            voxels: Some((&scan.voxels).into()),
            moments: Some(moments::beside(&scan.voxels, &scan.moments, StopSignal::NEVER)),
            carved: (!scan.carved.is_empty()).then(|| (&scan.carved).into()),
            viewpoint: scan.viewpoint.as_ref().map(Into::into),
        }
    }
}

impl TryFrom<pb::Insertion> for ScanRecord {
    type Error = Unreadable;

    fn try_from(message: pb::Insertion) -> Result<Self, Unreadable> {
        let voxels = required(message.voxels, "insertion.voxels")?.try_into()?;
        let carved = message.carved.unwrap_or_default().try_into()?;
        if !VoxelSet::is_disjoint(&voxels, &carved) {
            return Err("insertion.carved has voxels of insertion.voxels".into());
        }
        Ok(Self {
            pose: required(message.pose, "insertion.pose")?.try_into()?,
            moments: moments::read(&message.moments.unwrap_or_default(), &voxels, StopSignal::NEVER)?,
            voxels,
            carved,
            viewpoint: message.viewpoint.map(TryInto::try_into).transpose()?,
        })
    }
}

impl From<&WithdrawnChange> for pb::WithdrawnChange {
    fn from(&WithdrawnChange { change, revision }: &WithdrawnChange) -> Self {
        Self { change, revision }
    }
}

impl From<pb::WithdrawnChange> for WithdrawnChange {
    fn from(pb::WithdrawnChange { change, revision }: pb::WithdrawnChange) -> Self {
        Self { change, revision }
    }
}

impl From<(&RobotName, ForgottenIds<'_>)> for pb::ForgottenScans {
    fn from((robot, ids): (&RobotName, ForgottenIds<'_>)) -> Self {
        let mut end = 0;
        let gaps = ids.ranges.iter().flat_map(|&(first, last)| {
            let gap = first - std::mem::replace(&mut end, last);
            [gap, last - first]
        });
        Self {
            robot: robot.as_str().to_owned(),
            id_gaps: gaps.collect(),
            session: ids.session.map(|session| session.as_str().to_owned()).unwrap_or_default(),
            last_revision: ids.last_revision,
            is_of_closed_sessions: ids.session.is_none(),
        }
    }
}

/// Robots whose ranges of ids are read between two checks of the stop signal.
const ROBOTS_PER_STOP_CHECK: usize = 16;

/// The trajectory together with the ids of scans whose poses are no longer kept.
pub(crate) fn with_forgotten(
    mut trajectory: Trajectory,
    forgotten: &[pb::ForgottenScans],
    stop: StopSignal<'_>,
) -> Result<Trajectory, Unreadable> {
    for message in stop.paced(forgotten, ROBOTS_PER_STOP_CHECK) {
        let pb::ForgottenScans { robot, session, id_gaps, last_revision, is_of_closed_sessions } = message;
        let robot = RobotName::new(robot).map_err(|e| e.to_string())?;
        let session = SessionName::new(session).map_err(|e| e.to_string())?;
        let (ranges, rest) = id_gaps.as_chunks();
        if !rest.is_empty() || ranges.len() > ID_RANGES_PER_SESSION_MAX {
            let most = 2 * ID_RANGES_PER_SESSION_MAX;
            let found = id_gaps.len();
            return Err(format!(
                "the forgotten ids of robot {robot} are {found} numbers: pairs, at most {most}"
            ));
        }
        let mut end = 0u64;
        let range = |&[gap, length]: &[u64; 2]| {
            let first = end.checked_add(gap)?;
            end = first.checked_add(length)?;
            Some((first, end))
        };
        let ranges: Option<Vec<_>> = ranges.iter().map(range).collect();
        let ranges = ranges.ok_or_else(|| format!("the forgotten ids of robot {robot} go beyond 2^64"))?;
        let session = (!is_of_closed_sessions).then_some(&session);
        let ids = ForgottenIds { session, ranges: &ranges, last_revision: *last_revision };
        trajectory = trajectory.with_forgotten(&robot, &ids);
    }
    Ok(trajectory)
}
