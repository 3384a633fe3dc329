//! Scans: their poses, and with their voxels.

use super::{Unreadable, count, moments, required};
use crate::geometry::{self, rotation_xyzw, translation_m};
use crate::map::{RobotName, ScanRecord, TrajectoryPose, WithdrawnScan};
use crate::store::pb;

impl From<&TrajectoryPose> for pb::ScanPose {
    fn from(pose: &TrajectoryPose) -> Self {
        let [x, y, z] = translation_m(&pose.map_from_sensor);
        let [qx, qy, qz, qw] = rotation_xyzw(&pose.map_from_sensor);
        Self {
            robot: pose.robot.as_str().to_owned(),
            scan_id: pose.scan_id,
            timestamp_ns: pose.timestamp_ns,
            map_from_sensor: vec![x, y, z, qx, qy, qz, qw],
            revision: pose.revision,
            level_overlaps: pose.level_overlaps.clone(),
            iterations: pose.iterations,
            points_skipped: pose.points_skipped as u64,
            new_voxels: pose.new_voxels as u64,
            digest: pose.digest,
        }
    }
}

impl TryFrom<pb::ScanPose> for TrajectoryPose {
    type Error = Unreadable;

    fn try_from(message: pb::ScanPose) -> Result<Self, Unreadable> {
        let [x, y, z, qx, qy, qz, qw] = message.map_from_sensor[..] else {
            return Err(format!("a pose of {} numbers instead of 7", message.map_from_sensor.len()));
        };
        Ok(Self {
            robot: RobotName::new(&message.robot).map_err(|e| e.to_string())?,
            scan_id: message.scan_id,
            timestamp_ns: message.timestamp_ns,
            map_from_sensor: geometry::pose([x, y, z], [qx, qy, qz, qw]).map_err(|e| e.to_string())?,
            revision: message.revision,
            level_overlaps: message.level_overlaps,
            iterations: message.iterations,
            points_skipped: count(message.points_skipped),
            new_voxels: count(message.new_voxels),
            digest: message.digest,
        })
    }
}

impl From<&ScanRecord> for pb::Insertion {
    fn from(scan: &ScanRecord) -> Self {
        Self {
            pose: Some((&scan.pose).into()),
            voxels: Some((&scan.voxels).into()),
            moments: Some(moments::beside(&scan.voxels, &scan.moments)),
        }
    }
}

impl TryFrom<pb::Insertion> for ScanRecord {
    type Error = Unreadable;

    fn try_from(message: pb::Insertion) -> Result<Self, Unreadable> {
        let voxels = required(message.voxels, "insertion.voxels")?.try_into()?;
        Ok(Self {
            pose: required(message.pose, "insertion.pose")?.try_into()?,
            moments: moments::read(&message.moments.unwrap_or_default(), &voxels)?,
            voxels,
        })
    }
}

impl From<&WithdrawnScan> for pb::WithdrawnScan {
    fn from(&WithdrawnScan { scan, revision }: &WithdrawnScan) -> Self {
        Self { scan, revision }
    }
}

impl From<pb::WithdrawnScan> for WithdrawnScan {
    fn from(pb::WithdrawnScan { scan, revision }: pb::WithdrawnScan) -> Self {
        Self { scan, revision }
    }
}
