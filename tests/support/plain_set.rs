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

/// The hash of the voxels, as the documentation of [`ContentHash`](mrol::map::ContentHash) defines it.
pub fn content_hash(set: &PlainSet) -> u64 {
    let field = |i: i32| i as u64 & ((1 << 21) - 1);
    let mixed = |&[x, y, z]: &[i32; 3]| {
        let key = field(x) | field(y) << 21 | field(z) << 42;
        let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    set.iter().map(mixed).fold(0, u64::wrapping_add)
}

/// The content hash, and at every level: the set, the filters where there are some (nothing denied, counters equal a
/// recount), and single look-ups.
pub fn assert_equal(map: &MultiResolutionMap, model: &PlainSet) {
    // Before the view, which holds the locks that these take.
    let counts: Vec<usize> = (0..map.settings().levels).map(|level| map.voxels(level)).collect();
    let view = map.view();
    assert_eq!(view.version().hash.to_bits(), content_hash(model), "the content hash");
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
            assert_eq!(list.filter().is_some(), map.settings().filter.is_some());
            let is_recount = list.filter().is_none_or(|filter| {
                filter.len() == list.len() && filter.is_recount_of(list.iter().map(VoxelKey::to_bits))
            });
            assert!(is_recount, "counters of level {level}");
        }
        for &i in model.iter().take(20) {
            let neighbor = VoxelKey::new(up(i, level).map(|c| c + 1)).expect("in range");
            assert_eq!(view.contains(neighbor, level), expected.contains(&neighbor.index()));
        }
    }
}
