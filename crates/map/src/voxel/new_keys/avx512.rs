//! Eight cells at a time: a byte of the mask picks its keys from a register of eight.
#![expect(unsafe_code, reason = "vector intrinsics")]

use std::arch::x86_64::*;

use super::super::block::{CELLS, OFFSETS};
use super::append::append;
use crate::util::bits::for_each_bit;
use crate::util::cpu::Avx512;
use crate::voxel::block::BlockMask;

/// Cells a step: one register of keys.
const LANES: usize = 8;

/// See [`super::scalar::keys_gained_scalar`].
#[inline]
pub(super) fn keys_gained(
    _: Avx512,
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
#[target_feature(enable = "avx512f,avx512bw,popcnt")]
unsafe fn write_keys_gained(
    before: &BlockMask,
    added: &BlockMask,
    first: u64,
    up: u32,
    keys: *mut u64,
) -> usize {
    let before = load(&before.0);
    let after = _mm512_or_si512(before, load(&added.0));
    let gained = _mm512_andnot_si512(coarsened(before, up), coarsened(after, up));
    let mut cells = [0u8; CELLS / LANES];
    // SAFETY: 64 bytes are one register.
    unsafe { _mm512_storeu_si512(cells.as_mut_ptr().cast(), gained) };
    let (offsets, mut written) = (load(&OFFSETS[..LANES]), 0);
    for_each_bit(_mm512_test_epi8_mask(gained, gained), |byte| {
        let cells = cells[byte as usize];
        let first = first + OFFSETS[LANES * byte as usize];
        let keys_of_cells = _mm512_add_epi64(_mm512_set1_epi64(first as i64), offsets);
        let keys_gained = _mm512_maskz_compress_epi64(cells, keys_of_cells);
        // SAFETY: fewer keys than cells are written so far, and the caller left room for a register more.
        unsafe { _mm512_storeu_si512(keys.add(written).cast(), keys_gained) };
        written += cells.count_ones() as usize;
    });
    written
}

/// The SIMD variant of [`BlockMask::coarsened`].
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn coarsened(mask: __m512i, up: u32) -> __m512i {
    let word = match up {
        0 => return mask,
        1 => _mm512_test_epi8_mask(mask, mask),
        _ => u64::from(_mm512_test_epi64_mask(mask, mask)),
    };
    _mm512_zextsi128_si512(_mm_cvtsi64_si128(word as i64))
}

/// The first eight of `words`.
///
/// # Panics
/// When there are fewer.
#[inline]
#[target_feature(enable = "avx512f")]
fn load(words: &[u64]) -> __m512i {
    // SAFETY: eight u64 are one register.
    unsafe { _mm512_loadu_si512(words[..LANES].as_ptr().cast()) }
}
