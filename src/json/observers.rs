//! The scans that touched a voxel in JSON.

use serde::Serialize;
use utoipa::ToSchema;

use super::pose::JsonPose;
use super::vectors::VoxelIndex;
use super::version::JsonVersion;
use mrol_service::{ObserversAnswer, ObservingScan, WatchedScan};

/// The scans that touched a voxel.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Observers)]
pub struct JsonObservers {
    /// The voxel's indices.
    #[schema(value_type = VoxelIndex)]
    pub voxel: [i32; 3],
    /// The scans, newest first.
    pub scans: Vec<JsonObservingScan>,
    /// True where there are older ones, or may be.
    pub older_scans: bool,
    /// The version of the map that was looked at.
    #[serde(flatten)]
    pub version: JsonVersion,
}

/// A scan that touched a voxel.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ObservingScan)]
pub struct JsonObservingScan {
    /// The revision that it made.
    pub revision: u64,
    /// The robot that sent it.
    pub robot: String,
    /// The run of the robot's software.
    pub session: String,
    /// The robot's own number of it.
    pub scan_id: Option<u64>,
    /// When it was taken, nanoseconds since the Unix epoch.
    pub timestamp_ns: Option<i64>,
    /// Where it was taken.
    pub map_from_sensor: JsonPose,
}

impl From<ObserversAnswer> for JsonObservers {
    fn from(answer: ObserversAnswer) -> Self {
        let ObserversAnswer { voxel, scans, older_scans, version } = answer;
        let scans = scans.into_iter().map(JsonObservingScan::from).collect();
        Self { voxel: voxel.index(), scans, older_scans, version: version.into() }
    }
}

impl From<ObservingScan> for JsonObservingScan {
    fn from(ObservingScan { revision, scan }: ObservingScan) -> Self {
        let WatchedScan { robot, session, scan_id, timestamp_ns, map_from_sensor, carved_voxels: _ } = scan;
        Self {
            revision,
            robot: robot.to_string(),
            session: session.to_string(),
            scan_id,
            timestamp_ns,
            map_from_sensor: (&map_from_sensor).into(),
        }
    }
}
