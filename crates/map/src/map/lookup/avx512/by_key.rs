//! The look-up of known keys in the filter, eight keys a register.

use std::arch::x86_64::*;

use super::bloom::{BloomRegisters, Located};
use super::kernel::{GROUPS, WORD};
use crate::map::lookup::level_view::LevelView;
use crate::map::shards::SHARDS;
use crate::util::cpu::Avx512;
use crate::voxel::quantize::NO_KEY;
use crate::voxel::quantize::avx512::{LANES, lanes};

/// See `lookup::filter_contains`.
pub(in crate::map::lookup) fn filter_contains(
    _: Avx512,
    keys: &[u64],
    view: &LevelView<'_>,
    occupied: &mut [u64],
) {
    // SAFETY: the token says that the CPU has the features; there is a word for each 64 keys (asserted by our caller).
    unsafe {
        match view.hashes {
            2 => all_in_filter::<2>(keys, view, occupied),
            _ => all_in_filter::<0>(keys, view, occupied),
        }
    }
}

/// # Safety
/// Needs AVX-512 F and DQ, and a word of `occupied` for each 64 keys.
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn all_in_filter<const HASHES: u32>(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    // SAFETY: the features are there, and the view lives.
    unsafe {
        let r = BloomRegisters::load(view);
        let region_shift = _mm_cvtsi32_si128(view.region_shift as i32);
        for (keys, word) in keys.chunks(WORD).zip(occupied) {
            // All addresses first, as in the whole look-up, so that many loads are on their way at once.
            let mut located = [(Located::NONE, 0); GROUPS];
            for (group, located) in located.iter_mut().enumerate() {
                let eight = |at: usize| load_keys(keys.get(group * LANES + at..).unwrap_or_default());
                let keys = [eight(0), eight(EIGHT)];
                let shards = keys.map(|keys| shard(unpack(keys).map(|i| _mm512_sra_epi64(i, region_shift))));
                let is_key = !(u16::from(_mm512_movepi64_mask(keys[0]))
                    | u16::from(_mm512_movepi64_mask(keys[1])) << EIGHT);
                *located = (r.locate(halves_of(keys), halves_of(shards)[0]), is_key);
            }
            *word = 0;
            for (group, (located, is_key)) in located.iter().enumerate() {
                *word |= u64::from(is_key & r.sixteen::<HASHES>(located)) << (group * LANES);
            }
        }
    }
}

/// Keys of a register.
const EIGHT: usize = 8;

/// The first eight keys, [`NO_KEY`] after the last.
///
/// # Safety
/// Needs AVX-512 F.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn load_keys(keys: &[u64]) -> __m512i {
    if keys.len() >= EIGHT {
        // SAFETY: eight keys are one register.
        return unsafe { _mm512_loadu_si512(keys.as_ptr().cast()) };
    }
    let present = ((1u32 << keys.len()) - 1) as u8;
    // SAFETY: the load is masked to the keys that are.
    unsafe { _mm512_mask_loadu_epi64(_mm512_set1_epi64(NO_KEY as i64), present, keys.as_ptr().cast()) }
}

/// The indices of eight keys: the inverse of [`pack`].
#[inline]
#[target_feature(enable = "avx512f")]
fn unpack(keys: __m512i) -> [__m512i; 3] {
    let z = _mm512_srai_epi64::<43>(_mm512_slli_epi64::<1>(keys));
    let y = _mm512_srai_epi64::<43>(_mm512_slli_epi64::<22>(keys));
    [_mm512_srai_epi64::<43>(_mm512_slli_epi64::<43>(keys)), y, z]
}

/// The SIMD variant of `sharding::shard_of_region` for eight regions.
#[inline]
#[target_feature(enable = "avx512f")]
fn shard([x, y, z]: [__m512i; 3]) -> __m512i {
    let color = _mm512_slli_epi64::<2>(_mm512_add_epi64(y, z));
    let color = _mm512_add_epi64(color, _mm512_add_epi64(x, z));
    _mm512_and_si512(color, _mm512_set1_epi64(SHARDS as i64 - 1))
}

/// Low and high halves of sixteen keys.
#[inline]
#[target_feature(enable = "avx512f")]
fn halves_of([a, b]: [__m512i; 2]) -> [__m512i; 2] {
    const LOW: [i32; LANES] = [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30];
    const HIGH: [i32; LANES] = [1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31];
    [LOW, HIGH].map(|index| _mm512_permutex2var_epi32(a, lanes(&index), b))
}
