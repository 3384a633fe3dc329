//! The voxels of one level as blocks of that level, and the part of them in a region.

use super::occupied_voxel_list::tier_of;
use super::{MapView, Region};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_SIDE, BLOCKS_PER_LOOK, BlockMask, Cell, Lattice, VoxelKey, VoxelSet};

impl MapView<'_> {
    /// All voxels of `level` that the view covers, in blocks of 8 x 8 x 8 of them; once stopped, some of them.
    ///
    /// Takes 72 bytes a stored block meanwhile.
    pub fn level_blocks(&self, level: u32, stop: StopSignal<'_>) -> VoxelSet {
        let (_, up) = tier_of(level);
        let mut parts = Vec::with_capacity(self.lists(level).map(|list| list.blocks().len()).sum());
        let stored = self.lists(level).flat_map(|list| list.blocks().iter());
        parts.extend(stop.paced(stored, BLOCKS_PER_LOOK).map(|(block, mask)| coarsened(block, mask, up)));
        VoxelSet::of_blocks_until(parts, stop)
    }
}

/// The part of a block `up` levels coarser that the voxels of `block` are.
pub(super) fn coarsened(block: VoxelKey, mask: &BlockMask, up: u32) -> (VoxelKey, BlockMask) {
    if up == 0 {
        return (block, *mask);
    }
    let mut part = BlockMask::EMPTY;
    for cell in mask.cells(up) {
        part.insert(Cell::of_key(cell.voxel(block).ancestor(up)));
    }
    (block.ancestor(up), part)
}

impl VoxelSet {
    /// The voxels of this set, which are those of `level`, whose centers lie in `region`.
    pub fn part_in(&self, region: &Region, lattice: &Lattice, level: u32) -> Self {
        let (min_m, max_m) = region.bounds_m();
        let block_m = lattice.resolution_m(level) * f64::from(BLOCK_SIDE);
        // Whatever the rounding, a block less than a voxel away is looked at.
        let may_meet = |block: VoxelKey| {
            let index = block.index();
            (0..3).all(|axis| {
                let low = f64::from(index[axis]) * block_m;
                low - block_m <= max_m[axis] && low + 2.0 * block_m >= min_m[axis]
            })
        };
        let part = |&(block, mask): &(VoxelKey, BlockMask)| {
            let mut part = BlockMask::EMPTY;
            for cell in
                mask.cells(0).filter(|cell| region.contains(lattice.center_m(cell.voxel(block), level)))
            {
                part.insert(cell);
            }
            (block, part)
        };
        self.blocks().iter().filter(|(block, _)| may_meet(*block)).map(part).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::{MapContents, MapSettings, MultiResolutionMap};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn blocks_of_a_level_are_its_voxels_and_a_part_of_them_those_in_the_region(
            indices in prop::collection::vec(prop::array::uniform3(-40i32..40), 0..200),
            level in 0u32..6,
            low in prop::array::uniform3(-40.0f64..40.0),
            size in prop::array::uniform3(0.0f64..40.0),
        ) {
            let voxels = indices.into_iter().filter_map(VoxelKey::new).collect();
            let settings = MapSettings::new(1.0, 6);
            let map = MultiResolutionMap::restore(settings, MapContents::at(1, voxels)).unwrap();
            let view = map.view();
            let blocks = view.level_blocks(level, StopSignal::NEVER);
            let expected: BTreeSet<VoxelKey> = view.lists(level).flat_map(|list| list.iter()).collect();
            prop_assert_eq!(blocks.iter().collect::<BTreeSet<_>>(), expected);
            let region = Region::cuboid(low, std::array::from_fn(|i| low[i] + size[i])).unwrap();
            let part: BTreeSet<VoxelKey> = blocks.part_in(&region, map.lattice(), level).iter().collect();
            prop_assert_eq!(part, view.voxels_in(&region, level).into_iter().collect::<BTreeSet<_>>());
        }
    }
}
