//! The voxels of one level as blocks of that level, and the part of them in a region.

use crate::map::regions::{Region, VoxelSelection};
use crate::map::shards::tier_of;
use crate::map::view::MapView;
use crate::util::StopSignal;
use crate::voxel::{BLOCK_SIDE, BLOCKS_PER_STOP_CHECK, BlockMask, Cell, Lattice, VoxelKey, VoxelSet};

/// Voxels of a level as they were copied out of a map, with parts of one block apart: to be joined once the map is no
/// longer locked.
#[derive(Debug)]
pub struct BlockParts(Vec<(VoxelKey, BlockMask)>);

impl BlockParts {
    /// The voxels, in blocks of 8 x 8 x 8 of them; once stopped, some of them. Lets other work go first meanwhile.
    pub fn joined(self, stop: StopSignal<'_>) -> VoxelSet {
        VoxelSet::of_blocks_giving_way(self.0, stop)
    }
}

impl MapView<'_> {
    /// All voxels of `level` that the view covers; once stopped, some of them.
    ///
    /// Takes 72 bytes a stored block.
    pub fn level_blocks(&self, level: u32, stop: StopSignal<'_>) -> BlockParts {
        let (_, up) = tier_of(level);
        let mut parts = Vec::with_capacity(self.lists(level).map(|list| list.blocks().len()).sum());
        let stored = self.lists(level).flat_map(|list| list.blocks().iter());
        parts.extend(
            stop.paced(stored, BLOCKS_PER_STOP_CHECK).map(|(block, mask)| coarsened(block, mask, up)),
        );
        BlockParts(parts)
    }

    /// The selected voxels of `level`; some of them once stopped, or where there are more than
    /// `most` such blocks: then more than that.
    ///
    /// Takes [`MapView::selected_bytes_max`] meanwhile.
    pub fn selected_blocks(
        &self,
        level: u32,
        selection: &VoxelSelection,
        most: usize,
        stop: StopSignal<'_>,
    ) -> BlockParts {
        let (_, up) = tier_of(level);
        // Of so many parts at most is one block made.
        let parts_max = most.saturating_mul(1 << (3 * up));
        let mut parts = Vec::new();
        for list in self.lists(level) {
            if stop.is_stopped() || parts.len() > parts_max {
                break;
            }
            self.for_each_block(&list, selection, stop, |block, mask| {
                let part = self.part_in(selection, level, block, mask);
                if !part.is_empty() {
                    parts.push(coarsened(block, &part, up));
                }
            });
        }
        BlockParts(parts)
    }

    /// Bytes of memory that [`MapView::selected_blocks`] takes at most.
    pub fn selected_bytes_max(&self, level: u32, selection: &VoxelSelection) -> u64 {
        // A list that grows has up to twice the room, and its former one beside it.
        (3 * self.blocks_max(level, selection) * size_of::<(VoxelKey, BlockMask)>()) as u64
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

/// The voxels of `blocks`, which are those of `level`, whose centers lie in `region`; blocks without one are left out.
pub fn blocks_in(
    blocks: &[(VoxelKey, BlockMask)],
    region: &Region,
    lattice: &Lattice,
    level: u32,
) -> Vec<(VoxelKey, BlockMask)> {
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
        for cell in mask.cells(0).filter(|cell| region.contains(lattice.center_m(cell.voxel(block), level))) {
            part.insert(cell);
        }
        (block, part)
    };
    let parts = blocks.iter().filter(|(block, _)| may_meet(*block)).map(part);
    parts.filter(|(_, part)| !part.is_empty()).collect()
}

impl VoxelSet {
    /// The voxels of this set, which are those of `level`, whose centers lie in `region`.
    pub fn part_in(&self, region: &Region, lattice: &Lattice, level: u32) -> Self {
        blocks_in(self.blocks(), region, lattice, level).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::map::contents::MapContents;
    use crate::map::multi_resolution_map::MultiResolutionMap;
    use crate::map::regions::Frustum;
    use crate::map::settings::MapSettings;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn blocks_of_a_level_are_its_voxels_and_a_part_of_them_those_in_the_region(
            indices in prop::collection::vec(prop::array::uniform3(-40i32..40), 0..200),
            level in 0u32..6,
            low in prop::array::uniform3(-40.0f64..40.0),
            size in prop::array::uniform3(0.0f64..40.0),
            turned in prop::array::uniform3(-3.0f64..3.0),
        ) {
            let voxels = indices.into_iter().filter_map(VoxelKey::new).collect();
            let settings = MapSettings::new(1.0, 6);
            let map = MultiResolutionMap::restore(settings, MapContents::at(1, voxels)).unwrap();
            let view = map.view();
            let blocks = view.level_blocks(level, StopSignal::NEVER).joined(StopSignal::NEVER);
            let expected: BTreeSet<VoxelKey> = view.lists(level).flat_map(|list| list.iter()).collect();
            prop_assert_eq!(blocks.iter().collect::<BTreeSet<_>>(), expected);
            let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turned.into());
            let map_from_box = Pose::from_parts(nalgebra::Translation3::from(nalgebra::Vector3::from(low)), rotation);
            for region in [
                Region::cuboid(low, std::array::from_fn(|i| low[i] + size[i])).unwrap(),
                Region::oriented_box(map_from_box, size).unwrap(),
                Region::ball(low, size[0]).unwrap(),
            ] {
                let inside = |voxel: &VoxelKey| region.contains(map.lattice().center_m(*voxel, level));
                let expected: BTreeSet<VoxelKey> = blocks.iter().filter(inside).collect();
                let part = blocks.part_in(&region, map.lattice(), level);
                prop_assert_eq!(&part.iter().collect::<BTreeSet<_>>(), &expected);
                prop_assert_eq!(&view.voxels_in(&region, level).into_iter().collect::<BTreeSet<_>>(), &expected);
                let selection = VoxelSelection::from(Some(region));
                let selected = view.selected_blocks(level, &selection, usize::MAX, StopSignal::NEVER);
                let selected = selected.joined(StopSignal::NEVER);
                prop_assert_eq!(view.count_voxels(level, &selection, StopSignal::NEVER), selected.len());
                prop_assert_eq!(selected.iter().collect::<BTreeSet<_>>(), expected);
            }
            let everything = VoxelSelection::default();
            let all = view.selected_blocks(level, &everything, usize::MAX, StopSignal::NEVER);
            prop_assert_eq!(&all.joined(StopSignal::NEVER), &blocks);
            prop_assert_eq!(view.count_voxels(level, &everything, StopSignal::NEVER), blocks.len());
        }

        #[test]
        fn the_voxels_of_a_view_are_those_that_the_camera_sees(
            indices in prop::collection::vec(prop::array::uniform3(-40i32..40), 0..200),
            level in 0u32..6,
            at in prop::array::uniform3(-20.0f64..20.0),
            turn in prop::array::uniform3(-3.0f64..3.0),
            angles in prop::array::uniform2(0.2f64..2.5),
            far_m in 1.0f64..60.0,
            region in prop::option::of(prop::array::uniform3(-40.0f64..40.0)),
        ) {
            let voxels: VoxelSet = indices.into_iter().filter_map(VoxelKey::new).collect();
            let map = MultiResolutionMap::restore(MapSettings::new(1.0, 6), MapContents::at(1, voxels)).unwrap();
            let pose = Pose::new(at.into(), turn.into());
            let selection = VoxelSelection {
                region: region.map(|min_m| Region::cuboid(min_m, min_m.map(|c| c + 30.0)).unwrap()),
                view: Some(Frustum::new(pose, angles, [0.5, 0.5 + far_m]).unwrap()),
            };
            let view = map.view();
            let expected: BTreeSet<VoxelKey> = view.lists(level).flat_map(|list| list.iter())
                .filter(|voxel| selection.contains(map.lattice().center_m(*voxel, level))).collect();
            let mut listed = BTreeSet::new();
            let copy = view.level_voxels(level, &selection, usize::MAX, StopSignal::NEVER);
            copy.for_some(StopSignal::NEVER, |some| listed.extend(some.iter().copied()));
            prop_assert_eq!(view.count_voxels(level, &selection, StopSignal::NEVER), expected.len());
            prop_assert_eq!(listed, expected);
        }
    }
}
