//! The voxels of a level that keep-outs take: a search that halves space and leaves out what no shape meets.

use super::keep_outs::KeepOuts;
use super::shape::KeepOutShape;
use crate::map::regions::{Region, VoxelSelection};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, BlockMask, Cell, INDEX_MAX, INDEX_MIN, Lattice, VoxelKey, VoxelSet};

/// Places that are looked at for each voxel that may be found, at most: shapes are mostly inside, and of a sheet that
/// is as thin as a voxel, its neighbors are looked at too.
const PLACES_PER_VOXEL: usize = 4;
/// Places that may be looked at besides.
const PLACES_MIN: usize = 64 << 10;
/// Places between two looks at the stop signal: a millisecond or less of a prism with many corners.
const PLACES_PER_STOP_CHECK: usize = 1024;

/// Keep-outs take more voxels than may be found, or finding them takes as long as if they did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("keep-outs take more voxels")]
pub struct TooManyVoxels;

impl KeepOuts {
    /// The voxels of `level` whose centers lie in a keep-out, and that are among those of `selection`; without meaning
    /// once stopped.
    ///
    /// # Errors
    /// When there are more than `most`, or finding them out takes many times as long as there could be as many.
    pub fn voxels_of(
        &self,
        level: u32,
        selection: &VoxelSelection,
        lattice: &Lattice,
        most: usize,
        stop: StopSignal<'_>,
    ) -> Result<VoxelSet, TooManyVoxels> {
        let places = most.saturating_mul(PLACES_PER_VOXEL).saturating_add(PLACES_MIN);
        let mut found = VoxelSet::default();
        let mut search =
            Search { selection, lattice, level, places, most, stop, blocks: Vec::new(), voxels: 0 };
        for keep_out in self.iter() {
            search.voxels = 0;
            search.look_in(&keep_out.shape)?;
            // One by one, so that of keep-outs that lie over each other only one is kept.
            search.blocks.extend_from_slice(found.blocks());
            found = VoxelSet::of_blocks_until(std::mem::take(&mut search.blocks), stop);
            if found.len() > most {
                return Err(TooManyVoxels);
            }
        }
        Ok(found)
    }
}

/// What is looked for, and what was found.
struct Search<'a> {
    selection: &'a VoxelSelection,
    lattice: &'a Lattice,
    level: u32,
    /// Places that may still be looked at.
    places: usize,
    most: usize,
    stop: StopSignal<'a>,
    /// Blocks of the level's voxels that were found in the present shape, and how many voxels those are.
    blocks: Vec<(VoxelKey, BlockMask)>,
    voxels: usize,
}

/// A shape with the voxels that its bounds meet: inclusive ranges of indices.
struct Target<'s> {
    shape: &'s KeepOutShape,
    ranges: [(i32, i32); 3],
    /// By how much the distance of a far shape may be rounded, meters.
    rounding_m: f64,
}

impl Search<'_> {
    fn look_in(&mut self, shape: &KeepOutShape) -> Result<(), TooManyVoxels> {
        let (min_m, max_m) = shape.bounds_m();
        let farthest_m = min_m.iter().chain(&max_m).fold(0.0f64, |far, c| far.max(c.abs()));
        let everything = [(i32::MIN, i32::MAX); 3];
        let bounds = match self.selection.is_everything() {
            true => everything,
            false => self.ranges(self.selection.bounds_m()),
        };
        let of_shape = self.ranges((min_m, max_m));
        let ranges: [(i32, i32); 3] = std::array::from_fn(|axis| {
            (of_shape[axis].0.max(bounds[axis].0), of_shape[axis].1.min(bounds[axis].1))
        });
        if ranges.iter().any(|(low, high)| low > high) {
            return Ok(());
        }
        let target = Target { shape, ranges, rounding_m: 8.0 * f64::EPSILON * farthest_m };
        let widest = ranges.iter().map(|(low, high)| (high - low).unsigned_abs() + 1).max().unwrap_or(1);
        let halvings = widest.next_power_of_two().ilog2().max(BLOCK_LEVELS);
        // Cubes as wide as the bounds, aligned as blocks are: two along each axis at most.
        let [x, y, z] = ranges.map(|(low, high)| low >> halvings..=high >> halvings);
        for x in x {
            for y in y.clone() {
                for z in z.clone() {
                    self.look_at(&target, [x, y, z].map(|i| i << halvings), halvings)?;
                }
            }
        }
        Ok(())
    }

    /// Looks at the cube of 2^`halvings` voxels a side that begins with the voxel `first`.
    fn look_at(&mut self, target: &Target<'_>, first: [i32; 3], halvings: u32) -> Result<(), TooManyVoxels> {
        self.places = self.places.checked_sub(1).ok_or(TooManyVoxels)?;
        if self.places.is_multiple_of(PLACES_PER_STOP_CHECK) && self.stop.is_stopped() {
            // The next look ends the search: what it finds means nothing any more.
            self.places = 0;
        }
        if !target.may_meet(first, halvings) || !self.may_hold(target, first, halvings) {
            return Ok(());
        }
        if halvings == 0 {
            return self.look_at_voxel(target, first);
        }
        for child in 0..8 {
            let step = |axis: usize| (child >> axis & 1) << (halvings - 1);
            self.look_at(target, std::array::from_fn(|axis| first[axis] + step(axis)), halvings - 1)?;
        }
        Ok(())
    }

    fn look_at_voxel(&mut self, target: &Target<'_>, index: [i32; 3]) -> Result<(), TooManyVoxels> {
        let Some(key) = VoxelKey::new(index) else { return Ok(()) };
        let center_m = self.lattice.center_m(key, self.level);
        if !target.shape.contains(center_m) || !self.selection.contains(center_m) {
            return Ok(());
        }
        self.voxels += 1;
        if self.voxels > self.most {
            return Err(TooManyVoxels);
        }
        let (block, cell) = Cell::of(index);
        // The voxels of a block come one after the other.
        match self.blocks.last_mut() {
            Some((last, mask)) if *last == block => {
                mask.insert(cell);
            }
            _ => {
                let mut mask = BlockMask::EMPTY;
                mask.insert(cell);
                self.blocks.push((block, mask));
            }
        }
        Ok(())
    }

    /// False of a cube in which no center lies in the shape and the region: both are further from its center than its
    /// corners are.
    fn may_hold(&self, target: &Target<'_>, first: [i32; 3], halvings: u32) -> bool {
        let voxel_m = self.lattice.resolution_m(self.level);
        let side = f64::from(1u32 << halvings);
        let center_m = first.map(|i| (f64::from(i) + side / 2.0) * voxel_m);
        let half_diagonal_m = side * voxel_m * (3f64.sqrt() / 2.0 + 1e-9);
        let is_near = |region: &Region| region.distance_m(center_m) <= half_diagonal_m + target.rounding_m;
        target.shape.distance_m(center_m) <= half_diagonal_m + target.rounding_m
            && self.selection.region.as_ref().is_none_or(is_near)
            && self.selection.may_meet(center_m, half_diagonal_m)
    }

    /// The voxels of the level that a box meets, with one more on each side; none of them out of the level's range.
    fn ranges(&self, (min_m, max_m): ([f64; 3], [f64; 3])) -> [(i32, i32); 3] {
        let voxel_m = self.lattice.resolution_m(self.level);
        let (least, most) = (f64::from(INDEX_MIN >> self.level), f64::from(INDEX_MAX >> self.level));
        std::array::from_fn(|axis| {
            let (low, high) = ((min_m[axis] / voxel_m).floor() - 1.0, (max_m[axis] / voxel_m).floor() + 1.0);
            match low > most || high < least {
                true => (1, 0),
                false => (low.max(least) as i32, high.min(most) as i32),
            }
        })
    }
}

impl Target<'_> {
    /// True of a cube with voxels within the ranges.
    fn may_meet(&self, first: [i32; 3], halvings: u32) -> bool {
        let last = |axis: usize| first[axis] + ((1i32 << halvings) - 1);
        (0..3).all(|axis| first[axis] <= self.ranges[axis].1 && last(axis) >= self.ranges[axis].0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::keep_out::keep_outs::KeepOut;
    use crate::map::keep_out::test_shapes::shape;
    use crate::map::name::KeepOutName;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn keep_outs(shapes: impl IntoIterator<Item = KeepOutShape>) -> KeepOuts {
        let named = |(i, shape)| KeepOut {
            name: KeepOutName::new(&format!("k{i}")).unwrap(),
            shape,
            made_by: None,
            made_revision: 1,
            expires_at_ns: None,
        };
        shapes.into_iter().enumerate().map(named).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_voxels_of_keep_outs_are_those_whose_centers_lie_in_one(
            shapes in prop::collection::vec(shape(), 0..4),
            within in prop::option::of((prop::array::uniform3(-20.0..0.0f64), 0.0..30.0f64)),
            level in 0u32..4,
        ) {
            let lattice = Lattice::new(1.0, 4).unwrap();
            let region = within.map(|(min, side)| Region::cuboid(min, min.map(|c| c + side)).unwrap());
            let all = keep_outs(shapes);
            let is_inside = |key: &VoxelKey| {
                let center = lattice.center_m(*key, level);
                all.contains(center) && region.is_none_or(|region| region.contains(center))
            };
            let side = (-48i32 >> level)..=(48 >> level);
            let indices = side.clone().flat_map(|x| side.clone().flat_map({
                let side = side.clone();
                move |y| side.clone().map(move |z| [x, y, z])
            }));
            let expected: BTreeSet<VoxelKey> = indices.filter_map(VoxelKey::new).filter(is_inside).collect();
            let most = expected.len().max(1);
            let found = all.voxels_of(level, &region.into(), &lattice, 1 << 20, StopSignal::NEVER).unwrap();
            prop_assert_eq!(&found.iter().collect::<BTreeSet<_>>(), &expected);
            if expected.len() > 1 {
                let fewer = all.voxels_of(level, &region.into(), &lattice, most - 1, StopSignal::NEVER);
                prop_assert_eq!(fewer, Err(TooManyVoxels));
            }
        }
    }

    #[test]
    fn a_keep_out_as_large_as_maps_can_be_is_refused_after_few_looks() {
        let lattice = Lattice::new(0.05, 1).unwrap();
        let huge = |region: Region| keep_outs([KeepOutShape::of_region(region).unwrap()]);
        let sheet = Region::cuboid([-5e4, -5e4, 0.026], [5e4, 5e4, 0.027]).unwrap();
        for region in
            [Region::cuboid([-1e12; 3], [1e12; 3]).unwrap(), Region::ball([0.0; 3], 1e12).unwrap(), sheet]
        {
            let found =
                huge(region).voxels_of(0, &VoxelSelection::default(), &lattice, 1000, StopSignal::NEVER);
            assert_eq!(found, Err(TooManyVoxels));
            // Of a small part of it there are few.
            let part = Region::cuboid([0.0; 3], [0.1; 3]).unwrap();
            let found =
                huge(region).voxels_of(0, &Some(part).into(), &lattice, 1000, StopSignal::NEVER).unwrap();
            assert_eq!(found.len(), if region == sheet { 0 } else { 8 });
        }
    }

    #[test]
    fn keep_outs_that_lie_over_each_other_count_once() {
        let cube = KeepOutShape::of_region(Region::cuboid([0.0; 3], [10.0; 3]).unwrap()).unwrap();
        let all = keep_outs([cube.clone(), cube.clone(), cube]);
        let lattice = Lattice::new(1.0, 1).unwrap();
        assert_eq!(
            all.voxels_of(0, &VoxelSelection::default(), &lattice, 1000, StopSignal::NEVER).unwrap().len(),
            1000
        );
        assert!(all.voxels_of(0, &VoxelSelection::default(), &lattice, 999, StopSignal::NEVER).is_err());
    }

    #[test]
    fn once_stopped_it_ends() {
        let cube = KeepOutShape::of_region(Region::cuboid([-1e3; 3], [1e3; 3]).unwrap()).unwrap();
        let (lattice, gone) = (Lattice::new(0.001, 1).unwrap(), || true);
        let found = keep_outs([cube]).voxels_of(
            0,
            &VoxelSelection::default(),
            &lattice,
            1 << 40,
            StopSignal::when(&gone),
        );
        assert!(found.is_err());
    }
}
