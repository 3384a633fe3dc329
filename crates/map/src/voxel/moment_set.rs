//! Moments of many voxels: what a scan adds to a map's.

use hashbrown::HashMap;

use super::key::{INDEX_MAX, INDEX_MIN, VoxelKey};
use super::lattice::LatticeFromPoints;
use super::moments::{MOMENT_LEVEL, Moments};
use super::set::{BLOCKS_PER_STOP_CHECK, VoxelSet};
use crate::geometry::Point;
use crate::util::{StopSignal, sort_by_key_until};

/// Steps of an offset along a voxel's side.
const STEPS: i64 = Moments::UNITS / Moments::STEP;

/// Moments of distinct voxels of [`MOMENT_LEVEL`], ascending by key: what a scan adds to a map's.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MomentSet(Vec<(VoxelKey, Moments)>);

impl MomentSet {
    /// The moments of `points`, voxel by voxel; those without a voxel (not finite, out of range) are left out.
    pub fn of_points(points: &[Point], lattice_from_points: &LatticeFromPoints) -> Self {
        let mut moments = HashMap::<VoxelKey, Moments>::with_capacity(points.len() / 16);
        // Neighbors in a scan share voxels: one probe serves a run of points.
        let mut run: Option<(VoxelKey, Moments)> = None;
        for &point in points {
            let Some((voxel, steps)) = lattice_from_points.offset(point, MOMENT_LEVEL, STEPS) else {
                continue;
            };
            let offset = steps.map(|steps| steps * Moments::STEP);
            match &mut run {
                Some((key, sum)) if *key == voxel => *sum += Moments::of_offset(offset),
                _ => {
                    if let Some((key, sum)) = run.replace((voxel, Moments::of_offset(offset))) {
                        *moments.entry(key).or_default() += sum;
                    }
                }
            }
        }
        if let Some((key, sum)) = run {
            *moments.entry(key).or_default() += sum;
        }
        moments.into_iter().collect()
    }

    /// The moments of the centers of `voxels`, where points are not known.
    pub fn of_centers(voxels: &VoxelSet) -> Self {
        Self::of_centers_until(voxels, StopSignal::NEVER)
    }

    /// [`MomentSet::of_centers`] under a stop signal; once stopped, some of them.
    pub fn of_centers_until(voxels: &VoxelSet, stop: StopSignal<'_>) -> Self {
        let blocks = stop.pieces(voxels.blocks(), BLOCKS_PER_STOP_CHECK).flatten();
        Self::of_voxels_until(blocks.flat_map(|(block, mask)| mask.moments(*block)).collect(), stop)
    }

    /// A set of distinct voxels' moments, given in any order; once stopped, in any order.
    pub fn of_voxels_until(mut moments: Vec<(VoxelKey, Moments)>, stop: StopSignal<'_>) -> Self {
        sort_by_key_until(&mut moments, |(key, _)| *key, stop);
        Self(moments)
    }

    /// The key of a voxel of [`MOMENT_LEVEL`] from its packed form; none when no finest voxel can lie in it.
    pub fn key(bits: u64) -> Option<VoxelKey> {
        let indices = INDEX_MIN >> MOMENT_LEVEL..=INDEX_MAX >> MOMENT_LEVEL;
        VoxelKey::from_bits(bits).filter(|key| key.index().iter().all(|i| indices.contains(i)))
    }

    /// Voxel by voxel, ascending.
    pub fn as_slice(&self) -> &[(VoxelKey, Moments)] {
        &self.0
    }
}

impl FromIterator<(VoxelKey, Moments)> for MomentSet {
    /// A set of distinct voxels' moments, given in any order.
    fn from_iter<I: IntoIterator<Item = (VoxelKey, Moments)>>(moments: I) -> Self {
        Self::of_voxels_until(moments.into_iter().collect(), StopSignal::NEVER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::block::Cell;
    use crate::voxel::lattice::Lattice;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_voxels_of_points_tell_those_of_their_moments(
            points in proptest::collection::vec(proptest::array::uniform3(-9.0f32..9.0), 0..100),
        ) {
            let lattice = Lattice::new(0.25, 1).unwrap().from_map();
            let points: Vec<_> = points.into_iter().map(Point::from).collect();
            let voxels: VoxelSet = points.iter().filter_map(|&point| lattice.key(point)).collect();
            let set = MomentSet::of_points(&points, &lattice);
            prop_assert!(set.as_slice().iter().map(|(key, _)| *key).eq(voxels.moment_voxels()));
        }
    }

    #[test]
    fn points_fall_in_the_voxel_of_their_key_at_their_offset() {
        let lattice = Lattice::new(0.25, 1).unwrap().from_map();
        let set =
            MomentSet::of_points(&[Point::new(-0.25, 0.5, 1.5), Point::new(f32::NAN, 0.0, 0.0)], &lattice);
        let voxel = VoxelKey::new([-1, 0, 1]).unwrap();
        assert_eq!(set.as_slice(), [(voxel, Moments::of_offset([1024, 0, 0]))]);
    }

    #[test]
    fn offsets_are_rounded_to_steps_and_stay_below_the_side() {
        let lattice = Lattice::new(0.25, 1).unwrap().from_map();
        let step = 1.0 / STEPS as f32;
        let set = MomentSet::of_points(&[Point::new(0.5 + 2.4 * step, 0.5 + 2.6 * step, 0.999_99)], &lattice);
        let last = Moments::UNITS / 2 - Moments::STEP;
        let expected = Moments::of_offset([2 * Moments::STEP, 3 * Moments::STEP, last]);
        assert_eq!(set.as_slice(), [(VoxelKey::new([0; 3]).unwrap(), expected)]);
    }

    #[test]
    fn descendants_count_at_their_centers() {
        let lattice = Lattice::new(1.0, 1).unwrap().from_map();
        for cell in [[0, 0, 0], [3, 0, 1], [2, 3, 3], [1, 2, 0]] {
            let center = Point::from(cell.map(|c| c as f32 + 0.5));
            let expected = MomentSet::of_points(&[center], &lattice);
            let (_, bit) = Cell::of(cell);
            assert_eq!(Moments::of_descendants(1 << bit.bit()), expected.as_slice()[0].1, "{cell:?}");
        }
    }
}
