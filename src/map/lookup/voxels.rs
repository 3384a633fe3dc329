//! Rotate, translate, quantize, and keep each voxel once: what a scan touches.

use super::stages;
use crate::geometry::Point;
use crate::voxel::{LatticeFromPoints, VoxelKey, VoxelSet};

impl VoxelSet {
    /// The voxels that `points` fall in. Points without a voxel (not finite, out of range) are left out and
    /// counted.
    pub fn of_points(points: &[Point], lattice_from_points: &LatticeFromPoints) -> (Self, usize) {
        let mut keys = vec![0; points.len()];
        stages::keys(points, lattice_from_points, 0, &mut keys);
        let voxels: Vec<_> = keys.into_iter().filter_map(VoxelKey::from_bits).collect();
        let skipped = points.len() - voxels.len();
        (voxels.into_iter().collect(), skipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::Lattice;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn a_set_of_points_is_the_set_of_their_keys(points: Vec<[i8; 3]>) {
            let points: Vec<Point> = points.iter().map(|p| Point::from(p.map(f32::from))).collect();
            let quantize = Lattice::new(2.5, 1).unwrap().from_map();
            let keys: BTreeSet<VoxelKey> = points.iter().map(|&p| quantize.key(p).unwrap()).collect();
            let (set, skipped) = VoxelSet::of_points(&points, &quantize);
            prop_assert_eq!(skipped, 0);
            prop_assert_eq!(set.len(), keys.len());
            prop_assert_eq!(&set.iter().collect::<BTreeSet<_>>(), &keys);
            prop_assert_eq!(set, keys.into_iter().collect::<VoxelSet>());
        }
    }

    #[test]
    fn points_without_a_voxel_are_counted() {
        let points = [Point::new(f32::NAN, 0.0, 0.0), Point::new(0.1, 0.1, 0.1), Point::new(1e9, 0.0, 0.0)];
        let (set, skipped) = VoxelSet::of_points(&points, &Lattice::new(1.0, 1).unwrap().from_map());
        assert_eq!((set.len(), skipped), (1, 2));
    }
}
