//! How much memory a change of a map is to take, before it takes it.

use mrol_map::map::{MapSettings, MultiResolutionMap, SHARDS};
use mrol_map::voxel::{BlockMask, VoxelKey, VoxelSet};

/// A block's key and mask.
pub(crate) const BLOCK_BYTES: usize = size_of::<(VoxelKey, BlockMask)>();

/// The most memory by which `voxels`, with so many moments, were seen to make a map grow, the journal's record of them
/// included: with every point alone in its block 800 bytes a point and its filters, where 650 with those of the default
/// size were measured.
pub(crate) fn growth_bytes(settings: &MapSettings, voxels: &VoxelSet, moments: usize) -> u64 {
    const OF_BLOCK: usize = 512;
    const OF_VOXEL: usize = 32;
    const OF_MOMENTS: usize = 256;
    let bytes = voxels.blocks().len() * OF_BLOCK + voxels.len() * OF_VOXEL + moments * OF_MOMENTS;
    bytes as u64 + settings.filter_bytes_of(voxels)
}

/// Memory that taking voxels out takes: two copies of their blocks, their record, the keys of one shard's voxels with
/// what their filters lose, and a copy of the filters' planes.
pub(crate) fn removal_bytes(map: &MultiResolutionMap, voxels: &VoxelSet) -> u64 {
    const OF_RECORD: usize = 3;
    const OF_SHARD: usize = 36;
    let count = voxels.len();
    let planes = map.plane_bytes().min(count * 64);
    (2 * voxels.blocks().len() * BLOCK_BYTES + count * OF_RECORD + count * OF_SHARD / SHARDS + planes) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::bloom::FilterSettings;
    use mrol_map::voxel::VoxelKey;

    #[test]
    fn wide_filters_are_counted() {
        let settings = |bits_per_key| MapSettings {
            filter: Some(FilterSettings { hashes: 2, bits_per_key }),
            ..MapSettings::new(0.1, 4)
        };
        let voxels = (0..1000).map(|i| VoxelKey::new([8 * i, 0, 0]).unwrap()).collect();
        let growth = |bits_per_key| growth_bytes(&settings(bits_per_key), &voxels, 1000);
        assert_eq!(growth(1.0) / 1000, 512 + 32 + 256 + 3);
        // Four levels of 4096 bits and their counters.
        assert!(growth(4096.0) > 1000 * 4 * 2560);
        assert_eq!(growth_bytes(&MapSettings::query_only(0.1, 4), &voxels, 0) / 1000, 512 + 32);
    }
}
