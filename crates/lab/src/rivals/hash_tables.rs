//! Hash tables of packed keys, one for each level: the map of the paper's predecessor \[8\], which it compares with
//! (IV-C).

use super::structure::count_by_key;
use mrol_map::align::OccupiedVoxels;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::Lookup;
use mrol_map::voxel::{Lattice, VoxelKey, quantize};

/// A map of hashbrown sets with their default hasher, one for each level, behind the same transform as the map of this
/// crate.
#[derive(Debug)]
pub struct HashTables {
    lattice: Lattice,
    levels: Vec<hashbrown::HashSet<u64>>,
}

impl HashTables {
    /// Creates tables without a voxel.
    pub fn new(lattice: Lattice) -> Self {
        Self { lattice, levels: vec![hashbrown::HashSet::new(); lattice.levels() as usize] }
    }

    /// Inserts the voxels of `points`, at every level.
    pub fn insert(&mut self, points: &[Point], map_from_points: &Pose) {
        let mut keys = vec![quantize::NO_KEY; points.len()];
        quantize::keys(points, &self.lattice.from_points(map_from_points), 0, &mut keys);
        for voxel in keys.into_iter().filter_map(VoxelKey::from_bits) {
            // A coarse voxel is occupied where one of its children is.
            let mut ancestors = (0..).map(|up| voxel.ancestor(up).to_bits());
            self.levels.iter_mut().zip(&mut ancestors).all(|(level, key)| level.insert(key));
        }
    }

    /// Number of occupied voxels of `level`.
    pub fn voxels(&self, level: u32) -> usize {
        self.levels[level as usize].len()
    }
}

impl OccupiedVoxels for HashTables {
    fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Counts exactly, whatever `lookup` says: there is only one way to look up.
    fn hits(&self, points: &[Point], poses: &[Pose], level: u32, _lookup: Lookup) -> Vec<usize> {
        let keys = &self.levels[level as usize];
        let count =
            |pose| count_by_key(points, &self.lattice.from_points(pose), level, |key| keys.contains(&key));
        poses.iter().map(count).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
    use nalgebra::Vector3;

    #[test]
    fn hash_tables_hold_and_count_what_a_map_does() {
        let points: Vec<_> = (0..3000u16)
            .map(|i| [i % 31, i % 47, i % 7].map(|c| f32::from(c) * 0.11 - 2.0).into())
            .chain([Point::new(f32::NAN, 0.0, 0.0)])
            .collect();
        let pose = Pose::new(Vector3::new(0.3, -1.0, 0.2), Vector3::new(0.1, 0.2, -0.3));
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
        let scan = MappedScan::new(RobotName::new("r").unwrap(), pose);
        map.committer().insert_scan(ScanRecord::of_points(scan, &points, map.lattice()));
        let mut tables = HashTables::new(*map.lattice());
        tables.insert(&points, &pose);

        let poses = [pose, Pose::translation(0.2, 0.1, 0.0) * pose, Pose::identity()];
        for level in 0..4 {
            assert_eq!(tables.voxels(level), map.voxels(level));
            let hits = |voxels: &dyn OccupiedVoxels| voxels.hits(&points, &poses, level, Lookup::Exact);
            assert_eq!(hits(&tables), hits(&map));
            assert_eq!(hits(&tables)[0], 3000);
        }
    }
}
