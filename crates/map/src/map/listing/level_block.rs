//! One block of 8 x 8 x 8 voxels of any level, put together from the blocks that are stored.

use super::level_blocks::coarsened;
use crate::map::multi_resolution_map::MultiResolutionMap;
use crate::map::shards::tier_of;
use crate::map::view::MapView;
use crate::voxel::{BLOCK_LEVELS, BlockMask, CLUSTER_LEVELS, Cell, Cluster, VoxelKey};

impl MultiResolutionMap {
    /// The coarsest level whose blocks [`MapView::level_block`] gives: up to three more than the map has, since blocks
    /// hold three levels, and which of them are there is one more.
    pub fn block_levels_end(&self) -> u32 {
        (tier_of(self.settings.levels - 1).0 as u32 + 1) * BLOCK_LEVELS
    }
}

impl MapView<'_> {
    /// The voxels of `level` in `block`, a key three levels coarser: all of them where the view covers the whole map.
    /// Levels go up to [`MultiResolutionMap::block_levels_end`].
    pub fn level_block(&self, level: u32, block: VoxelKey) -> BlockMask {
        let (tier, up) = tier_of(level);
        if level == self.map().block_levels_end() {
            return self.stored_blocks(tier - 1, block);
        }
        if up == 0 {
            let tables = self.shards_of(block.index(), level + BLOCK_LEVELS);
            return tables.fold(BlockMask::EMPTY, |all, shard| all.union(shard.tiers[tier].get(block)));
        }
        let cluster = block.ancestor(CLUSTER_LEVELS - up);
        let mut voxels = BlockMask::EMPTY;
        self.for_each_cluster(tier, cluster, |stored| {
            for (stored, mask) in stored.blocks(cluster).filter(|(stored, _)| stored.ancestor(up) == block) {
                voxels = voxels.union(&coarsened(stored, mask, up).1);
            }
        });
        voxels
    }

    /// Which blocks of `tier` are there, of the 8 x 8 x 8 in `block`.
    fn stored_blocks(&self, tier: usize, block: VoxelKey) -> BlockMask {
        let mut there = BlockMask::EMPTY;
        for corner in 0..8 {
            let index = block.index();
            let cluster = VoxelKey::pack(std::array::from_fn(|axis| index[axis] * 2 + (corner >> axis & 1)));
            self.for_each_cluster(tier, cluster, |stored| {
                for (stored, _) in stored.blocks(cluster) {
                    there.insert(Cell::of_key(stored));
                }
            });
        }
        there
    }

    /// Calls `f` with the parts of a cluster of `tier`, which large ones have in several shards.
    fn for_each_cluster(&self, tier: usize, cluster: VoxelKey, f: impl FnMut(&Cluster)) {
        let level = tier as u32 * BLOCK_LEVELS + BLOCK_LEVELS + CLUSTER_LEVELS;
        self.shards_of(cluster.index(), level)
            .filter_map(|shard| shard.tiers[tier].cluster(cluster))
            .for_each(f);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::contents::MapContents;
    use crate::map::settings::MapSettings;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn a_block_of_any_level_holds_the_voxels_of_that_level(
            indices in prop::collection::vec(prop::array::uniform3(-700i32..700), 0..60),
            near in prop::collection::vec(prop::array::uniform3(-9i32..9), 0..60),
            levels in 1u32..=9,
        ) {
            let voxels = indices.into_iter().chain(near).filter_map(VoxelKey::new);
            let voxels: BTreeSet<VoxelKey> = voxels.collect();
            let contents = MapContents::at(1, voxels.iter().copied().collect());
            let map = MultiResolutionMap::restore(MapSettings::new(1.0, levels), contents).unwrap();
            let view = map.view();
            for level in 0..=map.block_levels_end() {
                let expected: BTreeSet<VoxelKey> = voxels.iter().map(|voxel| voxel.ancestor(level)).collect();
                let blocks: BTreeSet<VoxelKey> = expected.iter().map(|voxel| voxel.ancestor(BLOCK_LEVELS)).collect();
                let found = blocks.iter().flat_map(|&block| {
                    let mask = view.level_block(level, block);
                    mask.cells(0).map(move |cell| cell.voxel(block)).collect::<Vec<_>>()
                });
                prop_assert_eq!(found.collect::<BTreeSet<_>>(), expected);
            }
        }
    }
}
