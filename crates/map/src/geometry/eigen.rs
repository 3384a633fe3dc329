//! Eigenvalues of symmetric matrices, of whatever numbers.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, DimDiff, DimSub, OMatrix, SymmetricEigen, U1};

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
}
