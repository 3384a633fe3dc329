//! The reference implementation.

use crate::util::bits::for_each_bit;
use crate::voxel::block::{BlockMask, OFFSETS};

/// The reference implementation; `first` is the key of the block's first voxel of the level.
pub(super) fn keys_gained_scalar(
    before: &BlockMask,
    added: &BlockMask,
    first: u64,
    up: u32,
    keys: &mut Vec<u64>,
) {
    let gained = before.union(added).coarsened(up).difference(&before.coarsened(up));
    for (word, offsets) in gained.0.into_iter().zip(OFFSETS.chunks_exact(u64::BITS as usize)) {
        for_each_bit(word, |bit| keys.push(first + offsets[bit as usize]));
    }
}
