//! Points and poses.
//!
//! A transform's name holds both frames, so that `p_in_map = map_from_sensor * p_in_sensor`.

mod eigen;
mod point;
mod pose;
mod twist;

pub(crate) use eigen::symmetric_eigen;
pub use point::Point;
pub use pose::{
    EXTRAPOLATION_SHARE_MAX, Pose, PoseError, QUATERNION_NORM_ROUNDING, QUATERNION_NORM_TOLERANCE,
    extrapolate, is_finite, pose, pose_difference, rotation_xyzw, translation_m,
};
pub use twist::Twist;
