//! Poses: rigid transforms, and the checks that every one passes on its way in.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// A rigid transform in meters, double precision, named `a_from_b` wherever it appears.
pub type Pose = Isometry3<f64>;

/// How far a quaternion's norm may lie from one before it is refused instead of normalized.
pub const QUATERNION_NORM_TOLERANCE: f64 = 1e-3;

/// How far a quaternion's norm may lie from one by rounding alone. Such a quaternion is left as it is, so that a pose
/// that is sent or stored comes back bit for bit.
pub const QUATERNION_NORM_ROUNDING: f64 = 1e-9;

/// Why numbers are not a pose.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// A translation with NaN or infinity.
    #[error("translation_m must be finite, got {0:?}")]
    Translation([f64; 3]),
    /// A quaternion that is not finite or whose norm is not one.
    #[error(
        "rotation_xyzw must be a unit quaternion within {QUATERNION_NORM_TOLERANCE}, got {0:?} of norm {1}"
    )]
    Rotation([f64; 4], f64),
}

/// A pose from a translation in meters and a unit quaternion x, y, z, w.
///
/// # Errors
/// When a number is not finite, or the quaternion's norm is further from one than
/// [`QUATERNION_NORM_TOLERANCE`]; within it the quaternion is normalized, unless it is off by rounding alone.
pub fn pose(translation_m: [f64; 3], rotation_xyzw: [f64; 4]) -> Result<Pose, PoseError> {
    if !translation_m.iter().all(|c| c.is_finite()) {
        return Err(PoseError::Translation(translation_m));
    }
    let [x, y, z, w] = rotation_xyzw;
    let quaternion = Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    let error = (norm - 1.0).abs();
    if !norm.is_finite() || error > QUATERNION_NORM_TOLERANCE {
        return Err(PoseError::Rotation(rotation_xyzw, norm));
    }
    let rotation = if error <= QUATERNION_NORM_ROUNDING {
        UnitQuaternion::new_unchecked(quaternion)
    } else {
        UnitQuaternion::new_normalize(quaternion)
    };
    Ok(Pose::from_parts(Translation3::from(Vector3::from(translation_m)), rotation))
}

/// The translation in meters of a pose.
pub fn translation_m(pose: &Pose) -> [f64; 3] {
    pose.translation.vector.into()
}

/// The unit quaternion x, y, z, w of a pose.
pub fn rotation_xyzw(pose: &Pose) -> [f64; 4] {
    pose.rotation.coords.into()
}

/// How far two poses lie apart: (meters, degrees).
pub fn pose_difference(a: &Pose, b: &Pose) -> (f64, f64) {
    let a_from_b = a.inv_mul(b);
    (a_from_b.translation.vector.norm(), a_from_b.rotation.angle().to_degrees())
}

/// Times that a motion is thought to go on at most, see [`extrapolate`]: nobody keeps a velocity for longer.
pub const EXTRAPOLATION_SHARE_MAX: f64 = 10.0;

/// Where a motion at constant velocity leads that went from `before` to `last`, after `share` of the time that took.
///
/// Shares beyond [`EXTRAPOLATION_SHARE_MAX`] either way count as that, and NaN as none. Of poses so far apart that the
/// numbers end it is `last`.
pub fn extrapolate(before: &Pose, last: &Pose, share: f64) -> Pose {
    let share = if share.is_nan() { 0.0 } else { share };
    let share = share.clamp(-EXTRAPOLATION_SHARE_MAX, EXTRAPOLATION_SHARE_MAX);
    let motion = before.inv_mul(last);
    let turn = UnitQuaternion::from_scaled_axis(motion.rotation.scaled_axis() * share);
    let further = last * Pose::from_parts(Translation3::from(motion.translation.vector * share), turn);
    if is_finite(&further) { further } else { *last }
}

/// True when no number of the pose is NaN or infinite.
pub fn is_finite(pose: &Pose) -> bool {
    let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
    numbers.copied().all(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_round_trips_through_its_parts() {
        let rotation = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
        let before = Pose::from_parts(Translation3::new(1.0, 2.0, 3.0), rotation);
        let after = pose(translation_m(&before), rotation_xyzw(&before)).unwrap();
        let (meters, degrees) = pose_difference(&before, &after);
        assert!(meters < 1e-12 && degrees < 1e-5);
    }

    #[test]
    fn a_constant_velocity_goes_on() {
        let step = Pose::new(Vector3::new(0.2, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.1));
        let (before, last) = (Pose::identity(), step);
        let (meters, degrees) = pose_difference(&extrapolate(&before, &last, 1.0), &(step * step));
        assert!(meters < 1e-12 && degrees < 1e-5);
        let half = extrapolate(&before, &last, 0.5);
        assert!(((last.inv_mul(&half)).rotation.angle() - 0.05).abs() < 1e-12);
    }

    #[test]
    fn a_motion_goes_on_for_a_bounded_time_and_ends_nowhere_else_than_in_numbers() {
        let last = Pose::translation(1.0, 0.0, 0.0);
        for (share, x) in
            [(f64::INFINITY, 11.0), (1e300, 11.0), (10.0, 11.0), (-1e300, -9.0), (f64::NAN, 1.0), (9.5, 10.5)]
        {
            assert_eq!(extrapolate(&Pose::identity(), &last, share).translation.x, x, "after {share}");
        }
        let (here, far) = (Pose::translation(f64::MAX, 0.0, 0.0), Pose::translation(-f64::MAX, 0.0, 0.0));
        assert_eq!(extrapolate(&here, &far, 1.0), far);
    }

    #[test]
    fn a_pose_comes_back_bit_for_bit() {
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(0.5, 0.5, 0.5, 0.500_000_000_1));
        let before = Pose::from_parts(Translation3::new(1.0 / 3.0, -0.0, 3e-300), rotation);
        let after = pose(translation_m(&before), rotation_xyzw(&before)).unwrap();
        assert_eq!(translation_m(&before).map(f64::to_bits), translation_m(&after).map(f64::to_bits));
        assert_eq!(rotation_xyzw(&before).map(f64::to_bits), rotation_xyzw(&after).map(f64::to_bits));
    }

    #[test]
    fn a_quaternion_that_is_not_unit_is_refused_with_its_norm() {
        let error = pose([0.0; 3], [0.0, 0.0, 0.0, 2.0]).unwrap_err();
        assert!(error.to_string().contains("norm 2"), "{error}");
        assert!(pose([0.0; 3], [f64::NAN, 0.0, 0.0, 1.0]).is_err());
        assert!(pose([f64::INFINITY, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).is_err());
    }
}
