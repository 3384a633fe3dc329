//! A box of cells with the distance of each.

use std::num::NonZeroU8;

use super::cap::margin_of;
use super::rows::FAR;
use super::transform::Transform;
use crate::map::regions::CellBox;
use crate::util::StopSignal;
use crate::voxel::VoxelSet;

/// The distance of each cell of a box from the nearest occupied voxel of the level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DistanceBlock {
    /// Indices of the first cell.
    pub origin: [i32; 3],
    /// Number of cells along each axis.
    pub size: [usize; 3],
    /// The distance of cells that are so far from everything, or farther, quarter cells.
    pub cap: NonZeroU8,
    /// A byte a cell, x fastest, then y: quarter cells from the cell's center to the nearest occupied cube, rounded
    /// down; 0 for an occupied cell, and never more than `cap`.
    pub distances: Vec<u8>,
}

impl DistanceBlock {
    /// The distances of `cells` from `voxels`, those of the level in `cells` and [`margin_of`] the cap around them
    /// (others do no harm); none once stopped.
    ///
    /// Takes [`DistanceBlock::bytes_max`] of memory.
    pub fn of(voxels: &VoxelSet, cells: &CellBox, cap: NonZeroU8, stop: StopSignal<'_>) -> Option<Self> {
        let mut distances = vec![0; cells.size().iter().product()];
        if !distances.is_empty() {
            let transform = Transform::new(cells, cap, stop);
            let layers = transform.along_x_and_y(voxels)?;
            transform.along_z(&layers, &quarters_up_to(cap), &mut distances)?;
        }
        Some(Self { origin: cells.min(), size: cells.size(), cap, distances })
    }

    /// Bytes of memory that the distances of `cells` take while they are made, themselves among them.
    pub fn bytes_max(cells: &CellBox, cap: NonZeroU8) -> u64 {
        if cells.cells() == 0 {
            return 0;
        }
        let sizes = [cells.size(), cells.grown(margin_of(cap)).size()];
        let [[xs, ys, _], [wide_xs, wide_ys, wide_zs]] = sizes.map(|size| size.map(|cells| cells as u64));
        let square = size_of::<i16>() as u64;
        let layers = xs.saturating_mul(ys).saturating_mul(wide_zs).saturating_mul(square);
        let layer = wide_ys.saturating_mul(square * xs + wide_xs);
        layers.saturating_add(layer).saturating_add(cells.cells())
    }

    /// The distance at a cell, quarter cells; none outside of the block.
    pub fn at(&self, index: [i32; 3]) -> Option<u8> {
        let mut place = 0;
        for axis in (0..3).rev() {
            let along = usize::try_from(i64::from(index[axis]) - i64::from(self.origin[axis])).ok()?;
            if along >= self.size[axis] {
                return None;
            }
            place = place * self.size[axis] + along;
        }
        self.distances.get(place).copied()
    }
}

/// Distances by four times their squares, from 0 to that which is far, in quarter cells up to `cap`.
fn quarters_up_to(cap: NonZeroU8) -> Vec<u8> {
    let quarters = |square: u16| (4 * u32::from(square)).isqrt().min(cap.get().into()) as u8;
    (0..=FAR.unsigned_abs()).map(quarters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::distance_block::cap::DISTANCE_CAP_MAX;
    use crate::map::distance_block::transform::STEPS_PER_STOP_CHECK;
    use crate::voxel::{INDEX_MIN, Lattice, VoxelKey};
    use proptest::prelude::*;
    use std::cell::Cell;

    #[test]
    fn a_block_without_a_cell_takes_no_memory() {
        let lattice = Lattice::new(0.05, 4).unwrap();
        let none = CellBox::of_centers([-1e300, -1e300, 0.06], [1e300, 1e300, 0.07], &lattice, 0);
        assert_eq!((none.cells(), DistanceBlock::bytes_max(&none, DISTANCE_CAP_MAX)), (0, 0));
    }

    /// The definition: quarter cells from the center of `cell` to the nearest of `voxels`, rounded down.
    fn by_brute_force(cell: [i32; 3], voxels: &[[i32; 3]], cap: NonZeroU8) -> u8 {
        let square = |voxel: &[i32; 3]| {
            let along = |axis: usize| (2 * u64::from(voxel[axis].abs_diff(cell[axis]))).saturating_sub(1);
            (0..3).map(|axis| along(axis).pow(2)).sum::<u64>()
        };
        let least = voxels.iter().map(square).min().unwrap_or(u64::MAX / 4);
        (4 * least).isqrt().min(cap.get().into()) as u8
    }

    fn cells_of(min: [i32; 3], size: [i32; 3]) -> CellBox {
        let lattice = Lattice::new(1.0, 1).unwrap();
        let max_m = std::array::from_fn(|axis| f64::from(min[axis] + size[axis]));
        CellBox::of_centers(min.map(f64::from), max_m, &lattice, 0)
    }

    fn set_of(voxels: &[[i32; 3]]) -> VoxelSet {
        voxels.iter().filter_map(|index| VoxelKey::new(*index)).collect()
    }

    fn assert_exact(voxels: &[[i32; 3]], min: [i32; 3], size: [i32; 3], cap: NonZeroU8) {
        let cells = cells_of(min, size);
        let block = DistanceBlock::of(&set_of(voxels), &cells, cap, StopSignal::NEVER).unwrap();
        assert_eq!((block.origin, block.size), (min, size.map(|size| size as usize)));
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let cell = [min[0] + x, min[1] + y, min[2] + z];
                    let expected = by_brute_force(cell, voxels, cap);
                    assert_eq!(block.at(cell), Some(expected), "{cell:?} of {voxels:?}, capped at {cap}");
                }
            }
        }
        assert_eq!(block.at(min.map(|i| i - 1)), None);
        assert_eq!(block.at([min[0] + size[0], min[1], min[2]]), None);
    }

    proptest! {
        #[test]
        fn every_cell_knows_its_distance(
            voxels in prop::collection::vec(prop::array::uniform3(-40i32..40), 0..12),
            min in prop::array::uniform3(-30i32..20),
            size in prop::array::uniform3(1i32..14),
            cap in prop::num::u8::ANY.prop_filter_map("a cap", NonZeroU8::new),
        ) {
            assert_exact(&voxels, min, size, cap);
        }

        #[test]
        fn every_cell_knows_its_distance_up_to_the_largest_cap(
            voxels in prop::collection::vec(prop::array::uniform3(-110i32..110), 1..4),
            min in prop::array::uniform3(-30i32..20),
            size in prop::array::uniform3(1i32..8),
        ) {
            assert_exact(&voxels, min, size, DISTANCE_CAP_MAX);
        }
    }

    #[test]
    fn what_lies_just_within_the_margin_counts_and_what_lies_beyond_is_capped() {
        for cap in (1..=255).filter_map(NonZeroU8::new) {
            let margin = margin_of(cap);
            for axis in 0..3 {
                for away in [margin - 1, margin, margin + 1, -margin, -margin - 1] {
                    let mut voxel = [0; 3];
                    voxel[axis] = away;
                    assert_exact(&[voxel], [0; 3], [1; 3], cap);
                }
            }
            // A cube beyond the margin is as far as the cap says, at least.
            assert_eq!(by_brute_force([0; 3], &[[margin + 1, 0, 0]], cap), cap.get());
        }
    }

    #[test]
    fn a_block_at_the_end_of_the_lattice_is_like_any_other() {
        assert_exact(&[[INDEX_MIN, INDEX_MIN, INDEX_MIN + 2]], [INDEX_MIN; 3], [3; 3], DISTANCE_CAP_MAX);
    }

    #[test]
    fn a_block_of_no_cell_has_no_distance() {
        let cells = CellBox::of_centers([0.6; 3], [0.9; 3], &Lattice::new(1.0, 1).unwrap(), 0);
        let block = DistanceBlock::of(&set_of(&[[0; 3]]), &cells, DISTANCE_CAP_MAX, StopSignal::NEVER);
        assert_eq!(block.map(|block| (block.size, block.distances)), Some(([0; 3], vec![])));
    }

    #[test]
    fn it_is_given_up_at_the_next_look_and_looks_in_proportion_to_its_work() {
        let voxels: Vec<[i32; 3]> = (0..200).flat_map(|x| (0..200).map(move |y| [x, y, 0])).collect();
        for size in [[100, 1, 1], [1, 1, 100], [200, 200, 1], [200, 200, 30]] {
            let looks = Cell::new(0usize);
            let cells = cells_of([0; 3], size);
            let looks_of = |looks_max: usize| {
                looks.set(0);
                let stops = || looks.replace(looks.get() + 1) >= looks_max;
                let stop = StopSignal::when(&stops);
                let block = DistanceBlock::of(&set_of(&voxels), &cells, DISTANCE_CAP_MAX, stop);
                (block.is_some(), looks.get())
            };
            let (made, all) = looks_of(usize::MAX);
            let wide: usize = cells.grown(64).size().iter().product();
            assert!(made && wide / all <= STEPS_PER_STOP_CHECK, "{size:?}: {all} looks");
            for looks_max in [0, 1, all / 2, all - 1] {
                let (made, taken) = looks_of(looks_max);
                assert!(
                    !made && taken <= looks_max + 3,
                    "{size:?}: {taken} looks after {looks_max} of {all}"
                );
            }
        }
    }
}
