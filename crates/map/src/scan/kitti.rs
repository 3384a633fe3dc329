//! Poses as KITTI writes them: a line of 12 numbers, the matrix map_from_sensor without its last row.

use nalgebra::{Matrix3, Matrix3x4, Rotation3, Translation3, UnitQuaternion};

use crate::geometry::Pose;

/// Numbers of a line.
pub(super) const COLUMNS: usize = 12;

/// How far a product of two columns of a rotation may be from 0 or 1: files have six digits or more.
const ORTHONORMALITY_TOLERANCE: f64 = 1e-3;

/// The pose of a line, by rows.
pub(super) fn pose_of_row(numbers: &[f64; COLUMNS]) -> Result<Pose, String> {
    if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
        return Err(format!("a pose is of finite numbers, got {number}"));
    }
    let matrix = Matrix3x4::from_row_slice(numbers);
    let rotation = matrix.fixed_columns::<3>(0).into_owned();
    let off = (rotation.tr_mul(&rotation) - Matrix3::identity()).amax();
    // NaN, of numbers whose squares are too large, is too far off as well.
    let is_orthonormal = off <= ORTHONORMALITY_TOLERANCE;
    if !is_orthonormal {
        return Err(format!(
            "the left three columns of the 3x4 matrix must be a rotation within {ORTHONORMALITY_TOLERANCE}, they are \
             off by {off:.3}: a line has r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz"
        ));
    }
    if rotation.determinant() < 0.0 {
        return Err(
            "the left three columns of the 3x4 matrix are a reflection: their determinant is -1".to_owned()
        );
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
    Ok(Pose::from_parts(Translation3::from(matrix.column(3).into_owned()), rotation))
}
