//! Poses in JSON.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::vectors::{Quaternion, Vector3};
use mrol_map::geometry;
use mrol_map::geometry::{Pose, PoseError};

/// A pose: translation in meters, rotation as a unit quaternion x y z w.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = Pose)]
pub struct JsonPose {
    /// The translation \[x, y, z\], meters.
    #[schema(value_type = Vector3)]
    pub translation_m: [f64; 3],
    /// The rotation, a unit quaternion \[x, y, z, w\].
    #[schema(value_type = Quaternion)]
    pub rotation_xyzw: [f64; 4],
}

impl TryFrom<JsonPose> for Pose {
    type Error = PoseError;

    fn try_from(pose: JsonPose) -> Result<Self, PoseError> {
        geometry::pose(pose.translation_m, pose.rotation_xyzw)
    }
}

impl From<&Pose> for JsonPose {
    fn from(pose: &Pose) -> Self {
        Self { translation_m: geometry::translation_m(pose), rotation_xyzw: geometry::rotation_xyzw(pose) }
    }
}
