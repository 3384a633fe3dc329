//! What filters take of memory: by the settings of a map, before there is one.

use super::capacity_schedule;
use super::sharding::SHARDS;
use crate::map::settings::MapSettings;
use crate::voxel::{BLOCK_LEVELS, VoxelSet};

/// Bits of a filter for each bit of its plane: that bit, and its counter of four.
const BITS_A_BIT: f64 = 5.0;

impl MapSettings {
    /// Bytes of memory of the room that the filters of a map make for their first keys, at most; one without a voxel
    /// takes a word for each.
    pub fn first_filter_bytes(&self) -> u64 {
        let keys = capacity_schedule::FIRST * capacity_schedule::FACTOR;
        (SHARDS as f64 * f64::from(self.levels) * keys * self.filter_bytes_a_key()) as u64
    }

    /// Bytes of memory by which the filters of all levels grow with `voxels`, at most: room for more is made as they
    /// grow.
    pub fn filter_bytes_of(&self, voxels: &VoxelSet) -> u64 {
        let in_blocks = BLOCK_LEVELS.min(self.levels);
        let of_block = |level| voxels.blocks().iter().map(move |(_, mask)| mask.count(level));
        let keys: usize = (0..in_blocks).flat_map(of_block).sum();
        // Of the levels above each block has one voxel at most.
        let keys = keys + voxels.blocks().len() * (self.levels - in_blocks) as usize;
        (keys as f64 * capacity_schedule::FACTOR * self.filter_bytes_a_key()) as u64
    }

    fn filter_bytes_a_key(&self) -> f64 {
        self.filter.map_or(0.0, |filter| filter.bits_per_key * BITS_A_BIT / 8.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bloom::FilterSettings;
    use crate::map::contents::MapContents;
    use crate::map::multi_resolution_map::MultiResolutionMap;
    use crate::voxel::VoxelKey;

    fn filter_bytes(settings: MapSettings, voxels: VoxelSet) -> u64 {
        let map = MultiResolutionMap::restore(settings, MapContents::at(1, voxels)).unwrap();
        let levels = map.describe(0, 0).levels;
        levels.iter().filter_map(|level| level.filter).map(|filter| filter.bytes() as u64).sum()
    }

    #[test]
    fn filters_take_no_more_than_is_said_and_not_much_less() {
        let scattered = (0..3000).map(|i| VoxelKey::new([i * 1000 % 99_000, i * 77 - 50_000, i]).unwrap());
        let dense = (0..8000).map(|i| VoxelKey::new([i % 20, i / 20 % 20, i / 400]).unwrap());
        for voxels in [VoxelSet::default(), scattered.collect(), dense.collect()] {
            for (levels, bits_per_key) in [(1, 4096.0), (4, 14.0), (12, 300.0)] {
                let filter = Some(FilterSettings { hashes: 2, bits_per_key });
                let settings = MapSettings { filter, ..MapSettings::new(0.1, levels) };
                let said = settings.first_filter_bytes() + settings.filter_bytes_of(&voxels);
                let taken = filter_bytes(settings, voxels.clone());
                // A word for each filter that is smaller than one.
                assert!(taken <= said + 8 * 5 * 16 * 12, "{taken} of {said} bytes");
                assert!(voxels.is_empty() || taken >= said / 12, "{taken} of {said} bytes");
            }
        }
    }

    #[test]
    fn the_filters_of_a_map_without_a_voxel_take_a_word_each() {
        for levels in [1, 6, 12] {
            let settings = MapSettings::new(0.1, levels);
            let words = SHARDS as u64 * u64::from(levels);
            assert_eq!(filter_bytes(settings, VoxelSet::default()), words * 8 * 5);
        }
    }

    #[test]
    fn a_map_without_filters_takes_nothing_for_them() {
        let settings = MapSettings::query_only(0.1, 12);
        let voxels: VoxelSet = (0..3000).map(|i| VoxelKey::new([i, 0, 0]).unwrap()).collect();
        assert_eq!((settings.first_filter_bytes(), settings.filter_bytes_of(&voxels)), (0, 0));
        assert_eq!(filter_bytes(settings, voxels), 0);
    }
}
