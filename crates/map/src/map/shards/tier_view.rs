//! What serves one level of a map, read cluster by cluster: for questions that follow a path through space.

use super::occupied_voxel_list::{OccupiedVoxelList, tier_of};
use super::sharding::{SHARDS, shard_of_region};
use crate::voxel::{BLOCK_LEVELS, CLUSTER_LEVELS, CLUSTER_SIDE, Cluster, INDEX_MIN, Slots, VoxelKey};

/// Levels from a cell, the smallest voxel of a tier, up to a cluster of its blocks.
const CELL_TO_CLUSTER: u32 = BLOCK_LEVELS + CLUSTER_LEVELS;

/// The clusters of the tier of blocks that serves one level, shard by shard.
///
/// Indices are those of **cells**: the smallest voxels of the tier, [`TierView::up`] levels below the level's voxels.
#[derive(Debug, Clone)]
pub(crate) struct TierView<'a> {
    slots: [Slots<'a>; SHARDS],
    up: u32,
    /// From a cell's index to its region.
    region_shift: u32,
    cell_m: f64,
    /// Clusters from the map's origin to where indices end, each way.
    clusters_to_border: i32,
}

impl<'a> TierView<'a> {
    /// A view of the lists of `level` that `list` gives; a shard without one is read as empty. `region_shift` is that
    /// of the tier's cells, whose side is `cell_m`.
    pub(in crate::map) fn new(
        level: u32,
        region_shift: u32,
        cell_m: f64,
        list: impl Fn(usize) -> Option<OccupiedVoxelList<'a>>,
    ) -> Self {
        let (tier, up) = tier_of(level);
        let below = tier as u32 * BLOCK_LEVELS + CELL_TO_CLUSTER;
        Self {
            slots: std::array::from_fn(|i| list(i).map_or(Slots::NONE, |list| list.blocks().slots())),
            up,
            region_shift,
            cell_m,
            clusters_to_border: -(INDEX_MIN >> below),
        }
    }

    /// How many levels a voxel of the level lies above a cell: 0, 1 or 2.
    pub(crate) fn up(&self) -> u32 {
        self.up
    }

    /// Side of a cell, meters.
    pub(crate) fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Levels from a cell up to the largest aligned cube of which one cluster of one shard holds everything: 5 where a
    /// region is no smaller than a cluster.
    pub(crate) fn piece_levels(&self) -> u32 {
        CELL_TO_CLUSTER.min(self.region_shift)
    }

    /// The cluster that holds everything in the piece (see [`TierView::piece_levels`]) around `cell`; of the rest of
    /// its space it may hold a part.
    #[inline(always)]
    pub(crate) fn cluster_around(&self, cell: [i32; 3]) -> Option<&'a Cluster> {
        let shard = shard_of_region(cell.map(|i| i >> self.region_shift));
        self.in_shard(shard, VoxelKey::pack(cell.map(|i| i >> CELL_TO_CLUSTER)))
    }

    /// Index of the cluster that the place `at`, in cells, lies in; of the nearest one where it lies beyond where
    /// indices end.
    #[inline(always)]
    pub(crate) fn cluster_index(&self, at: [f64; 3]) -> [i32; 3] {
        let clusters = at.map(|c| (c / f64::from(CLUSTER_SIDE)).floor());
        let border = f64::from(self.clusters_to_border);
        clusters.map(|c| c.clamp(-border, border - 1.0) as i32)
    }

    /// True where a region is no smaller than a cluster, so that one shard holds all of it.
    #[inline(always)]
    pub(crate) fn has_whole_clusters(&self) -> bool {
        self.region_shift >= CELL_TO_CLUSTER
    }

    /// The clusters `key` of all shards that have it: one, where a region is no smaller than a cluster.
    #[inline(always)]
    pub(crate) fn clusters(&self, key: VoxelKey) -> impl Iterator<Item = &'a Cluster> {
        let (first, last) = if self.has_whole_clusters() {
            let shift = self.region_shift - CELL_TO_CLUSTER;
            let shard = shard_of_region(key.index().map(|i| i >> shift));
            (shard, shard)
        } else {
            (0, SHARDS - 1)
        };
        (first..=last).filter_map(move |shard| self.in_shard(shard, key))
    }

    #[inline(always)]
    fn in_shard(&self, shard: usize, cluster: VoxelKey) -> Option<&'a Cluster> {
        let slots = self.slots[shard];
        slots.find(cluster.to_bits()).map(|slot| &slots.clusters[slot])
    }
}
