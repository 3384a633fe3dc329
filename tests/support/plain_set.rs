//! A plain set of voxels as the oracle of a map.

use std::collections::BTreeSet;

use mrol::map::MultiResolutionMap;
use mrol::voxel::VoxelKey;

/// Indices of the finest voxels.
pub type PlainSet = BTreeSet<[i32; 3]>;

/// The index of the voxel `level` levels up.
pub fn up(index: [i32; 3], level: u32) -> [i32; 3] {
    index.map(|i| i >> level)
}

/// At every level: the set, the filters (nothing denied, counters equal a recount), and single look-ups.
pub fn assert_equal(map: &MultiResolutionMap, model: &PlainSet) {
    // Before the view, which holds the locks that these take.
    let counts: Vec<usize> = (0..map.settings().levels).map(|level| map.voxels(level)).collect();
    let view = map.view();
    for (level, count) in (0..).zip(counts) {
        let expected: PlainSet = model.iter().map(|&i| up(i, level)).collect();
        let found: PlainSet = view.lists(level).flat_map(|list| list.iter()).map(VoxelKey::index).collect();
        assert_eq!(found, expected, "level {level}");
        assert_eq!(count, expected.len());
        for list in view.lists(level) {
            assert!(
                list.iter().all(|voxel| list.contains(voxel)),
                "the filter denies a voxel of level {level}"
            );
            assert!(
                list.filter().is_recount_of(list.iter().map(VoxelKey::to_bits)),
                "counters of level {level}"
            );
        }
        for &i in model.iter().take(20) {
            let neighbor = VoxelKey::new(up(i, level).map(|c| c + 1)).expect("in range");
            assert_eq!(view.contains(neighbor, level), expected.contains(&neighbor.index()));
        }
    }
}
