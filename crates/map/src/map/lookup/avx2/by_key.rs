//! The look-up of known keys in the filter, a batch at a time.

use super::bloom::Planes;
use super::kernel::{BATCH, Batch, LookupKernel};
use crate::map::lookup::level_view::LevelView;
use crate::map::shards::shard_of_region;
use crate::util::cpu::Avx2;
use crate::voxel::VoxelKey;
use crate::voxel::quantize::NO_KEY;

/// See `lookup::filter_contains`.
pub(in crate::map::lookup) fn filter_contains(
    _: Avx2,
    keys: &[u64],
    view: &LevelView<'_>,
    occupied: &mut [u64],
) {
    // SAFETY: the token says that the CPU has the features.
    unsafe { all_in_filter(keys, view, occupied) }
}

#[target_feature(enable = "avx2")]
fn all_in_filter(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    let (planes, mut batch) = (Planes::of(view), Batch::EMPTY);
    for (keys, words) in keys.chunks(BATCH).zip(occupied.chunks_mut(BATCH / 64)) {
        let mut is_key = [0u64; BATCH / 64];
        for (i, &key) in keys.iter().enumerate() {
            let index = VoxelKey::from_bits(key).map_or([0; 3], VoxelKey::index);
            for (axis, index) in batch.index.iter_mut().zip(index) {
                axis[i] = index;
            }
            batch.shard[i] = shard_of_region(index.map(|i| i >> view.region_shift)) as i32;
            is_key[i / 64] |= u64::from(key != NO_KEY) << (i % 64);
        }
        // SAFETY: the feature is there, and the view lives.
        let hits = unsafe { planes.look_up(&batch, keys.len()) };
        words.iter_mut().zip(hits).zip(is_key).for_each(|((word, hits), is_key)| *word = hits & is_key);
    }
}
