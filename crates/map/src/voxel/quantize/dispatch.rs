//! Quantization, with the widest kernel that the machine has.

use super::scalar;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
use crate::geometry::Point;
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};
use crate::voxel::lattice::LatticeFromPoints;

/// Packed keys (`VoxelKey::to_bits`) of the voxels of `level` that points fall in, [`NO_KEY`](super::NO_KEY) for a
/// point without a voxel (not finite, out of range). `keys[i]` is that of `points[i]`.
///
/// # Panics
/// When `keys` is not as long as `points`.
pub fn keys(points: &[Point], lattice_from_points: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    assert_eq!(keys.len(), points.len(), "one key for each point");
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx512::detect() {
        return avx512::keys(cpu, points, lattice_from_points, level, keys);
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx2::detect() {
        return avx2::keys(cpu, points, lattice_from_points, level, keys);
    }
    scalar::keys(points, lattice_from_points, level, keys);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::voxel::lattice::Lattice;
    use proptest::prelude::*;

    type Keys = fn(&[Point], &LatticeFromPoints, u32, &mut [u64]);

    /// The variants that this machine can run.
    fn variants() -> Vec<(&'static str, Keys)> {
        #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut, reason = "there is no other variant"))]
        let mut variants: Vec<(&'static str, Keys)> = vec![("dispatched", keys)];
        #[cfg(target_arch = "x86_64")]
        if Avx2::detect().is_some() {
            variants.push(("avx2", |points, quantize, level, keys| {
                avx2::keys(Avx2::detect().expect("AVX2"), points, quantize, level, keys);
            }));
        }
        variants
    }

    /// Points of a cube of 60 voxels, on borders too, and some that no voxel holds.
    fn points() -> impl Strategy<Value = Vec<Point>> {
        let coordinate = prop_oneof![
            20 => (-120i32..120).prop_map(|i| i as f32 * 0.125),
            1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, -3e5, 524_288.0]),
        ];
        prop::collection::vec(prop::array::uniform3(coordinate).prop_map(Point::from), 0..150)
    }

    proptest! {
        #[test]
        fn simd_keys_are_the_scalar_ones(points in points(), level in 0u32..5, turned: bool) {
            let pose = match turned {
                true => Pose::new([0.3, -7.0, 1.0].into(), [0.4, -0.2, 2.0].into()),
                false => Pose::identity(),
            };
            let quantize = Lattice::new(0.5, 5).unwrap().from_points(&pose);
            let mut expected = vec![1; points.len()];
            scalar::keys(&points, &quantize, level, &mut expected);
            for (name, keys) in variants() {
                let mut found = vec![2; points.len()];
                keys(&points, &quantize, level, &mut found);
                prop_assert_eq!(&found, &expected, "{}", name);
            }
        }
    }
}
