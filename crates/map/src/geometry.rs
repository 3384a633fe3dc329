//! Points and poses: the nalgebra aliases and the checks every pose passes on its way in.
//!
//! A transform's name holds both frames, so that `p_in_map = map_from_sensor * p_in_sensor`.

mod twist;

pub use twist::Twist;

use bytemuck::{Pod, Zeroable};
use nalgebra::allocator::Allocator;
use nalgebra::{
    DefaultAllocator, DimDiff, DimSub, Isometry3, OMatrix, Quaternion, SymmetricEigen, Translation3, U1,
    UnitQuaternion, Vector3,
};

/// A rigid transform in meters, double precision, named `a_from_b` wherever it appears.
pub type Pose = Isometry3<f64>;

/// How far a quaternion's norm may lie from one before it is refused instead of normalized.
pub const QUATERNION_NORM_TOLERANCE: f64 = 1e-3;

/// How far a quaternion's norm may lie from one by rounding alone. Such a quaternion is left as it is, so that a pose
/// that is sent or stored comes back bit for bit.
pub const QUATERNION_NORM_ROUNDING: f64 = 1e-9;

/// A point of three little-endian f32 (x, y, z in meters): the wire form *is* the memory form.
///
/// It has alignment 1, so that the bytes of a request, at whatever address the network left them, are a
/// `&[Point]` without a copy.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Point([[u8; 4]; 3]);

impl Point {
    /// Bytes of one point on the wire and in memory.
    pub const BYTES: usize = 12;

    /// The point (x, y, z), meters.
    #[inline]
    pub fn new(x: f32, y: f32, z: f32) -> Self {
        Self([x.to_le_bytes(), y.to_le_bytes(), z.to_le_bytes()])
    }

    /// The coordinates \[x, y, z\], meters.
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

/// Iterations after which no eigenvalue of a symmetric matrix is waited for; of finite numbers a few dozen do.
const EIGEN_ITERATIONS_MAX: usize = 1000;

/// Eigenvalues and eigenvectors of a symmetric matrix; none where a number is not finite, or they do not come within
/// [`EIGEN_ITERATIONS_MAX`] iterations (nalgebra itself would go on for ever, its issue 1025).
pub(crate) fn symmetric_eigen<D>(matrix: OMatrix<f64, D, D>) -> Option<SymmetricEigen<f64, D>>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    if !matrix.iter().all(|number| number.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, EIGEN_ITERATIONS_MAX)?;
    let finite = eigen.eigenvalues.iter().chain(eigen.eigenvectors.iter()).all(|number| number.is_finite());
    finite.then_some(eigen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Matrix6};

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
    fn hostile_matrices_have_eigenvalues_or_none_and_end_nothing() {
        let of = |value: f64| Matrix3::new(value, 1.0, value, 1.0, -value, 2.0, value, 2.0, 1e-300);
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(symmetric_eigen(of(value)).is_none(), "{value}");
            assert!(symmetric_eigen(Matrix6::from_element(value)).is_none(), "{value}");
        }
        for value in [f64::MAX, 1e300, 1e-300, f64::MIN_POSITIVE, 5e-324, 0.0, -1e155] {
            for finite in [symmetric_eigen(of(value)), symmetric_eigen(Matrix3::from_element(value))] {
                assert!(finite.is_none_or(|eigen| eigen.eigenvalues.iter().all(|value| value.is_finite())));
            }
        }
        let usual = symmetric_eigen(Matrix3::new(2.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 5.0)).unwrap();
        assert!((usual.eigenvalues.sum() - 9.0).abs() < 1e-12);
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
