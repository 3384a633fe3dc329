//! The look-up as it is defined, point by point; the reference implementation, which runs where the CPU has no
//! SIMD instructions.

use super::level_view::{LevelView, Lookup};
use crate::bloom::Probe;
use crate::geometry::Point;
use crate::map::shards::shard_of_region;
use crate::voxel::{Cell, LatticeFromPoints, VoxelKey};

/// See [`super::by_point::occupied`].
pub(super) fn occupied(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    let look_up = match lookup {
        Lookup::Exact => exact,
        Lookup::Bloom => bloom,
    };
    let mut all_have_a_voxel = true;
    for (points, word) in points.chunks(64).zip(occupied) {
        *word = 0;
        for (bit, &point) in points.iter().enumerate() {
            match lattice_from_points.index(point) {
                Some(index) => *word |= u64::from(look_up(view, index.map(|i| i >> view.level))) << bit,
                None => all_have_a_voxel = false,
            }
        }
    }
    all_have_a_voxel
}

/// Takes back the bits of points that the filter let through and the set does not hold.
pub(super) fn confirm(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) {
    for (points, word) in points.chunks(64).zip(occupied) {
        let mut let_through = *word;
        while let_through != 0 {
            let bit = let_through.trailing_zeros();
            let_through &= let_through - 1;
            let index = lattice_from_points.index(points[bit as usize]);
            let occupied = index.is_some_and(|index| exact(view, index.map(|i| i >> view.level)));
            *word &= !(u64::from(!occupied) << bit);
        }
    }
}

#[inline(always)]
fn shard(view: &LevelView<'_>, index: [i32; 3]) -> usize {
    shard_of_region(index.map(|i| i >> view.region_shift))
}

#[inline(always)]
pub(super) fn bloom(view: &LevelView<'_>, index: [i32; 3]) -> bool {
    let plane = view.planes[shard(view, index)];
    let probe = Probe::of(VoxelKey::pack(index).to_bits(), view.hashes, plane.len());
    plane[probe.word] & probe.mask == probe.mask
}

#[inline(always)]
pub(super) fn exact(view: &LevelView<'_>, index: [i32; 3]) -> bool {
    let (block, cell) = Cell::of(index.map(|i| i << view.up));
    view.blocks[shard(view, index)].get(block).contains(cell, view.up)
}
