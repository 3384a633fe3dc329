//! The reference implementation, point by point.

use crate::geometry::Point;
use crate::voxel::key::VoxelKey;
use crate::voxel::lattice::LatticeFromPoints;

/// Stands among keys for a point that has no voxel; no key sets bit 63.
pub const NO_KEY: u64 = u64::MAX;

/// See [`super::keys`].
pub(super) fn keys(points: &[Point], lattice_from_points: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    for (&point, key) in points.iter().zip(keys) {
        let index = lattice_from_points.index(point);
        *key = index.map_or(NO_KEY, |index| VoxelKey::pack(index.map(|i| i >> level)).to_bits());
    }
}
