//! What a shard has of one level beside the blocks of its tier.

use super::capacity_schedule::CapacitySchedule;
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
    /// A level without a voxel, of the shard with this number.
    pub(super) fn empty(shard: usize, level: usize, settings: &MapSettings) -> Self {
        let capacity = CapacitySchedule::of(shard, level).for_items(1);
        let filter = settings.filter.map(|filter| CountingBloomFilter::with_capacity(capacity, filter));
        Self { voxels: 0, filter }
    }
}
