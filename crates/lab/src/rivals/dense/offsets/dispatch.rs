//! Offsets by the fastest variant that this machine runs, and the reference implementation.

#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
use crate::rivals::dense::grid::Grid;
use mrol_map::geometry::Point;
#[cfg(target_arch = "x86_64")]
use mrol_map::util::cpu::{Avx2, Avx512};
use mrol_map::voxel::LatticeFromPoints;

/// Computes the offset of each point in `grid`: rotates, translates and quantizes to `level`. A point outside of the
/// grid, or without a voxel, gets [`Grid::cells`].
///
/// # Panics
/// When `offsets` is not as long as `points`.
pub fn offsets(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    assert_eq!(offsets.len(), points.len(), "one offset for each point");
    debug_assert!(grid.cells() < 1 << 32);
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx512::detect() {
        return avx512::offsets(cpu, points, lattice_from_points, level, grid, offsets);
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx2::detect() {
        return avx2::offsets(cpu, points, lattice_from_points, level, grid, offsets);
    }
    offsets_scalar(points, lattice_from_points, level, grid, offsets);
}

/// The reference implementation of [`offsets`].
fn offsets_scalar(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    for (&point, offset) in points.iter().zip(offsets) {
        let index = lattice_from_points.index(point);
        *offset = index.map_or(grid.cells() as u32, |index| grid.offset(index.map(|i| i >> level)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry::Pose;
    use mrol_map::voxel::Lattice;
    use proptest::prelude::*;

    type Offsets = fn(&[Point], &LatticeFromPoints, u32, &Grid, &mut [u32]);

    /// The variants that this machine can run.
    fn variants() -> Vec<(&'static str, Offsets)> {
        #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut, reason = "there is no other variant"))]
        let mut variants: Vec<(&'static str, Offsets)> = vec![("dispatched", offsets)];
        #[cfg(target_arch = "x86_64")]
        if Avx2::detect().is_some() {
            variants.push(("avx2", |points, quantize, level, grid, offsets| {
                avx2::offsets(Avx2::detect().expect("AVX2"), points, quantize, level, grid, offsets);
            }));
        }
        variants
    }

    proptest! {
        #[test]
        fn simd_offsets_are_the_scalar_ones(
            points in prop::collection::vec(
                prop::array::uniform3(prop_oneof![20 => -15f32..15.0, 1 => Just(f32::NAN)]).prop_map(Point::from),
                0..150,
            ),
            level in 0u32..4,
        ) {
            let pose = Pose::new([0.3, -7.0, 1.0].into(), [0.4, -0.2, 2.0].into());
            let quantize = Lattice::new(0.5, 4).unwrap().from_points(&pose);
            let grid = Grid { min: [-20, -9, 3], size: [33, 18, 7] };
            let mut expected = vec![1; points.len()];
            offsets_scalar(&points, &quantize, level, &grid, &mut expected);
            for (name, offsets) in variants() {
                let mut found = vec![2; points.len()];
                offsets(&points, &quantize, level, &grid, &mut found);
                prop_assert_eq!(&found, &expected, "{}", name);
            }
        }
    }
}
