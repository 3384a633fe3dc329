//! The objective of the paper's predecessor \[9\]: hits at all levels as a weighted sum.

use mrol_map::align::OccupiedVoxels;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{Lookup, MultiResolutionMap};
use mrol_map::voxel::Lattice;

/// A map whose hits are a weighted sum over all levels, each weighted twice as much as the next coarser one.
///
/// The ascent of the paper climbs on it unchanged: at each level the steps are of that level, and the objective is the
/// sum over all of them (paper III-B names it as what the search level by level took the place of).
#[derive(Debug)]
pub struct WeightedSum<'a>(pub &'a MultiResolutionMap);

impl OccupiedVoxels for WeightedSum<'_> {
    fn lattice(&self) -> &Lattice {
        self.0.lattice()
    }

    /// Returns the weighted hits over all levels, whatever `level` says.
    fn hits(&self, points: &[Point], poses: &[Pose], _level: u32, lookup: Lookup) -> Vec<usize> {
        let coarsest = self.lattice().levels() - 1;
        let mut sums = vec![0; poses.len()];
        for level in 0..=coarsest {
            let hits = self.0.hits(points, poses, level, lookup);
            sums.iter_mut().zip(hits).for_each(|(sum, hits)| *sum += hits << (coarsest - level));
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::{MapContents, MapSettings};
    use mrol_map::voxel::VoxelSet;

    #[test]
    fn a_point_counts_one_at_the_coarsest_level_and_twice_as_much_at_each_finer_one() {
        let map = MultiResolutionMap::new(MapSettings::new(1.0, 3)).unwrap();
        let (voxels, _) = VoxelSet::of_points(&[Point::new(0.5, 0.5, 0.5)], &map.lattice().from_map());
        let map = MultiResolutionMap::restore(*map.settings(), MapContents::at(1, voxels)).unwrap();
        // In the voxel itself, in its parent's, in its grandparent's, and out of all.
        let points = [0.5, 1.5, 2.5, 4.5].map(|x| Point::new(x, 0.5, 0.5));
        let sums: Vec<usize> = points
            .iter()
            .map(|point| WeightedSum(&map).hits(&[*point], &[Pose::identity()], 0, Lookup::Exact)[0])
            .collect();
        assert_eq!(sums, [4 + 2 + 1, 2 + 1, 1, 0]);
    }
}
