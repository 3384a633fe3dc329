//! A hash set of packed keys: the paper's "de facto method".

use super::structure::{Structure, occupied_by_key, voxels};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MultiResolutionMap;
use mrol_map::voxel::{Lattice, VoxelKey};

/// A hashbrown set of packed keys with its default hasher.
#[derive(Debug)]
pub struct HashSet {
    keys: hashbrown::HashSet<u64>,
    lattice: Lattice,
    level: u32,
}

impl HashSet {
    /// Builds the set of the occupied voxels of `level` of a map.
    pub fn of(map: &MultiResolutionMap, level: u32) -> Self {
        let mut keys = hashbrown::HashSet::with_capacity(map.voxels(level));
        keys.extend(voxels(&map.view(), level).map(VoxelKey::to_bits));
        Self { keys, lattice: *map.lattice(), level }
    }

    /// The packed keys.
    pub fn keys(&self) -> &hashbrown::HashSet<u64> {
        &self.keys
    }
}

impl Structure for HashSet {
    fn occupied(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64]) {
        let quantize = self.lattice.from_points(map_from_points);
        occupied_by_key(points, &quantize, self.level, occupied, |key| self.keys.contains(&key));
    }

    fn bytes(&self) -> usize {
        hash_set_bytes(&self.keys)
    }
}

/// Bytes of the table of a set.
pub fn hash_set_bytes(keys: &hashbrown::HashSet<u64>) -> usize {
    keys.allocation_size()
}
