//! Four cells at a time: half a byte of the mask picks its keys from a register of four.
#![expect(unsafe_code, reason = "vector intrinsics")]

use std::arch::x86_64::*;

use super::super::block::OFFSETS;
use super::append::append;
use crate::util::bits::for_each_bit;
use crate::util::cpu::Avx2;
use crate::voxel::block::BlockMask;

/// Cells a step: one register of keys.
const LANES: usize = 4;

/// See [`super::scalar::keys_gained_scalar`].
#[inline]
pub(super) fn keys_gained(
    _: Avx2,
    before: &BlockMask,
    added: &BlockMask,
    first: u64,
    up: u32,
    keys: &mut Vec<u64>,
) {
    // Each step writes a whole register, however few keys it keeps. SAFETY: the token says that the CPU has the
    // features; a key a cell is written at most, and a register behind them.
    unsafe { append(keys, LANES, |keys| write_keys_gained(before, added, first, up, keys)) }
}

/// Writes the keys to `keys`; how many.
///
/// # Safety
/// `keys` must have room for a key a cell and a register more.
#[target_feature(enable = "avx2,popcnt")]
unsafe fn write_keys_gained(
    before: &BlockMask,
    added: &BlockMask,
    first: u64,
    up: u32,
    keys: *mut u64,
) -> usize {
    let gained = before.union(added).coarsened(up).difference(&before.coarsened(up));
    // SAFETY: four u64 are one register.
    let offsets = unsafe { _mm256_loadu_si256(OFFSETS[..LANES].as_ptr().cast()) };
    let mut written = 0;
    for (word, of_word) in gained.0.into_iter().zip(OFFSETS.chunks_exact(u64::BITS as usize)) {
        // A bit for each half byte that is not zero: its lowest.
        let halves = (word | word >> 1 | word >> 2 | word >> 3) & 0x1111_1111_1111_1111;
        for_each_bit(halves, |cell| {
            let cells = (word >> cell & 0xf) as usize;
            let first = first + of_word[cell as usize];
            let keys_of_cells = _mm256_add_epi64(_mm256_set1_epi64x(first as i64), offsets);
            // SAFETY: eight i32 are one register.
            let picked = unsafe { _mm256_loadu_si256(PICKED[cells].as_ptr().cast()) };
            let keys_gained = _mm256_permutevar8x32_epi32(keys_of_cells, picked);
            // SAFETY: fewer keys than cells are written so far, and the caller left room for a register more.
            unsafe { _mm256_storeu_si256(keys.add(written).cast(), keys_gained) };
            written += cells.count_ones() as usize;
        });
    }
    written
}

/// For each half byte the lanes of its bits, first: halves of lanes, as the permutation counts them.
static PICKED: [[i32; 2 * LANES]; 1 << LANES] = {
    let mut picked = [[0; 2 * LANES]; 1 << LANES];
    let mut cells = 0;
    while cells < 1 << LANES {
        let (mut lane, mut place) = (0, 0);
        while lane < LANES {
            if cells >> lane & 1 == 1 {
                picked[cells][place] = 2 * lane as i32;
                picked[cells][place + 1] = 2 * lane as i32 + 1;
                place += 2;
            }
            lane += 1;
        }
        cells += 1;
    }
    picked
};
