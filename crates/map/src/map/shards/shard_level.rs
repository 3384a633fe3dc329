//! What a shard has of one level beside the blocks of its tier.

use crate::bloom::CountingBloomFilter;
use crate::map::settings::MapSettings;

/// The number of a level's voxels in one shard, and their filter.
#[derive(Debug)]
pub(in crate::map) struct ShardLevel {
    /// Occupied voxels.
    pub(in crate::map) voxels: usize,
    /// The keys of the same voxels; none in a map without filters.
    pub(in crate::map) filter: Option<CountingBloomFilter>,
}

impl ShardLevel {
    /// A level without a voxel. Its filter has no room yet: the first key makes it, so that the many shards of a small
    /// map that hold nothing take nothing.
    pub(super) fn empty(settings: &MapSettings) -> Self {
        Self { voxels: 0, filter: settings.filter.map(CountingBloomFilter::without_room) }
    }
}
