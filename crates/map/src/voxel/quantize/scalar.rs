//! The reference implementation, point by point.

use super::NO_KEY;
use crate::geometry::Point;
use crate::voxel::key::VoxelKey;
use crate::voxel::lattice::LatticeFromPoints;

/// See [`super::keys`].
pub(super) fn keys(points: &[Point], lattice_from_points: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    for (&point, key) in points.iter().zip(keys) {
        let index = lattice_from_points.index(point);
        *key = index.map_or(NO_KEY, |index| VoxelKey::pack(index.map(|i| i >> level)).to_bits());
    }
}
