//! Points and poses: the nalgebra aliases and the checks every pose passes on its way in.
//!
//! A transform's name holds both frames, so that `p_in_map = map_from_sensor * p_in_sensor`.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// A rigid transform in metres, double precision, named `a_from_b` wherever it appears.
pub type Pose = Isometry3<f64>;

/// How far a quaternion's norm may lie from one before it is refused instead of normalised.
pub const QUATERNION_NORM_TOLERANCE: f64 = 1e-3;

/// How far a quaternion's norm may lie from one by rounding alone. Such a quaternion is left as it is, so that a pose
/// that is sent or stored comes back bit for bit.
pub const QUATERNION_NORM_ROUNDING: f64 = 1e-9;

/// A point of three little-endian f32 (x, y, z in metres): the wire form *is* the memory form.
///
/// It has alignment 1, so that the bytes of a request, at whatever address the network left them, are a
/// `&[Point]` without a copy.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Point([[u8; 4]; 3]);

impl Point {
    /// Bytes of one point on the wire and in memory.
    pub const BYTES: usize = 12;

    /// The point (x, y, z), metres.
    #[inline]
    pub fn new(x: f32, y: f32, z: f32) -> Self {
        Self([x.to_le_bytes(), y.to_le_bytes(), z.to_le_bytes()])
    }

    /// Its coordinates \[x, y, z\], metres.
    #[inline]
    pub fn xyz(self) -> [f32; 3] {
        self.0.map(f32::from_le_bytes)
    }

    /// True when no coordinate is NaN or infinite. Depth cameras use NaN for "no return".
    #[inline]
    pub fn is_finite(self) -> bool {
        self.xyz().iter().all(|c| c.is_finite())
    }

    /// The point in double precision.
    #[inline]
    pub fn to_f64(self) -> nalgebra::Point3<f64> {
        self.xyz().map(f64::from).into()
    }
}

impl From<[f32; 3]> for Point {
    #[inline]
    fn from([x, y, z]: [f32; 3]) -> Self {
        Self::new(x, y, z)
    }
}

impl From<nalgebra::Point3<f64>> for Point {
    fn from(p: nalgebra::Point3<f64>) -> Self {
        Self::new(p.x as f32, p.y as f32, p.z as f32)
    }
}

impl std::fmt::Debug for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.xyz();
        write!(f, "({x}, {y}, {z})")
    }
}

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

/// A pose from a translation in metres and a unit quaternion x, y, z, w.
///
/// # Errors
/// When a number is not finite, or the quaternion's norm is further from one than
/// [`QUATERNION_NORM_TOLERANCE`]; within it the quaternion is normalised, unless it is off by rounding alone.
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

/// The translation in metres of a pose.
pub fn translation_m(pose: &Pose) -> [f64; 3] {
    pose.translation.vector.into()
}

/// The unit quaternion x, y, z, w of a pose.
pub fn rotation_xyzw(pose: &Pose) -> [f64; 4] {
    pose.rotation.coords.into()
}

/// How far two poses lie apart: (metres, degrees).
pub fn pose_difference(a: &Pose, b: &Pose) -> (f64, f64) {
    let a_from_b = a.inv_mul(b);
    (a_from_b.translation.vector.norm(), a_from_b.rotation.angle().to_degrees())
}

/// Where a motion at constant velocity leads that went from `before` to `last`, after `share` of the time that took.
pub fn extrapolate(before: &Pose, last: &Pose, share: f64) -> Pose {
    let motion = before.inv_mul(last);
    let turn = UnitQuaternion::from_scaled_axis(motion.rotation.scaled_axis() * share);
    last * Pose::from_parts(Translation3::from(motion.translation.vector * share), turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_at_any_address_are_points() {
        let mut bytes = vec![0u8];
        bytes.extend([1.5f32, -2.0, 3.25].iter().flat_map(|c| c.to_le_bytes()));
        let points: &[Point] = bytemuck::cast_slice(&bytes[1..]);
        assert_eq!(points, &[Point::new(1.5, -2.0, 3.25)]);
    }

    #[test]
    fn a_pose_round_trips_through_its_parts() {
        let rotation = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
        let before = Pose::from_parts(Translation3::new(1.0, 2.0, 3.0), rotation);
        let after = pose(translation_m(&before), rotation_xyzw(&before)).unwrap();
        let (metres, degrees) = pose_difference(&before, &after);
        assert!(metres < 1e-12 && degrees < 1e-5);
    }

    #[test]
    fn a_constant_velocity_goes_on() {
        let step = Pose::new(Vector3::new(0.2, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.1));
        let (before, last) = (Pose::identity(), step);
        let (metres, degrees) = pose_difference(&extrapolate(&before, &last, 1.0), &(step * step));
        assert!(metres < 1e-12 && degrees < 1e-5);
        let half = extrapolate(&before, &last, 0.5);
        assert!(((last.inv_mul(&half)).rotation.angle() - 0.05).abs() < 1e-12);
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
