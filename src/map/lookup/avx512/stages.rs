//! The stages of a look-up, sixteen points or eight keys at a time. All must only be called where
//! [`super::is_available`].

use std::arch::x86_64::*;

use super::bloom::{BloomRegisters, Located};
use super::place::{Quantize, deinterleave, load};
use super::registers::{halves_of, pack};
use super::{GROUPS, LANES, WORD};
use crate::geometry::Point;
use crate::map::lookup::LevelView;
use crate::map::lookup::stages::{Grid, NO_KEY};
use crate::map::sharding::SHARDS;
use crate::voxel::LatticeFromPoints;

/// See `lookup::stages::keys`.
pub(in crate::map::lookup) fn keys(points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    debug_assert!(super::is_available());
    // SAFETY: the caller checked for the features, and that there is a key for each point.
    unsafe { all_keys(points, t, level, keys) }
}

/// See `lookup::stages::offsets`.
pub(in crate::map::lookup) fn offsets(
    points: &[Point],
    t: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    debug_assert!(super::is_available());
    // SAFETY: the caller checked for the features, and that there is an offset for each point.
    unsafe { all_offsets(points, t, level, grid, offsets) }
}

/// See `lookup::stages::filter_contains`.
pub(in crate::map::lookup) fn filter_contains(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    debug_assert!(super::is_available());
    // SAFETY: the caller checked for the features, and that there is a word for each 64 keys.
    unsafe {
        match view.hashes {
            2 => all_in_filter::<2>(keys, view, occupied),
            _ => all_in_filter::<0>(keys, view, occupied),
        }
    }
}

/// # Safety
/// Needs AVX-512 F and DQ, and a key for each point.
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn all_keys(points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    let (quantize, level) = (Quantize::load(t), _mm_cvtsi32_si128(level as i32));
    let none = _mm512_set1_epi64(NO_KEY as i64);
    for (points, keys) in points.chunks(LANES).zip(keys.chunks_mut(LANES)) {
        // SAFETY: the feature is there, and stores are masked to the keys that are.
        unsafe {
            let (index, valid) = index(&quantize, level, points);
            let [a, b] = pack(index);
            let present = (1u32 << keys.len()) - 1;
            let (a, b) = (
                _mm512_mask_mov_epi64(none, valid as u8, a),
                _mm512_mask_mov_epi64(none, (valid >> 8) as u8, b),
            );
            _mm512_mask_storeu_epi64(keys.as_mut_ptr().cast(), present as u8, a);
            _mm512_mask_storeu_epi64(keys.as_mut_ptr().wrapping_add(8).cast(), (present >> 8) as u8, b);
        }
    }
}

/// # Safety
/// Needs AVX-512 F and DQ, and an offset for each point.
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn all_offsets(points: &[Point], t: &LatticeFromPoints, level: u32, grid: &Grid, offsets: &mut [u32]) {
    let (quantize, level) = (Quantize::load(t), _mm_cvtsi32_si128(level as i32));
    let (min, size) =
        (grid.min.map(|m| _mm512_set1_epi32(m)), grid.size.map(|s| _mm512_set1_epi32(s as i32)));
    let outside = _mm512_set1_epi32(grid.cells() as u32 as i32);
    for (points, offsets) in points.chunks(LANES).zip(offsets.chunks_mut(LANES)) {
        // SAFETY: the feature is there, and the store is masked to the offsets that are.
        unsafe {
            let (index, mut inside) = index(&quantize, level, points);
            let cell: [__m512i; 3] = std::array::from_fn(|k| _mm512_sub_epi32(index[k], min[k]));
            for (cell, size) in cell.iter().zip(size) {
                inside &= _mm512_cmplt_epu32_mask(*cell, size);
            }
            let [x, y, z] = cell;
            let row = _mm512_add_epi32(_mm512_mullo_epi32(z, size[1]), y);
            let offset = _mm512_add_epi32(_mm512_mullo_epi32(row, size[0]), x);
            let offset = _mm512_mask_mov_epi32(outside, inside, offset);
            let present = ((1u32 << offsets.len()) - 1) as u16;
            _mm512_mask_storeu_epi32(offsets.as_mut_ptr().cast(), present, offset);
        }
    }
}

/// Indices of a level, and a bit for each of up to sixteen points that has them.
///
/// # Safety
/// Needs AVX-512 F.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn index(quantize: &Quantize, level: __m128i, points: &[Point]) -> ([__m512i; 3], u16) {
    // SAFETY: the feature is there.
    let coordinates = unsafe { load(points) };
    let (index, valid) = quantize.index(deinterleave(coordinates));
    (index.map(|i| _mm512_sra_epi32(i, level)), valid)
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

/// The twin of `sharding::shard_of_region` for eight regions.
#[inline]
#[target_feature(enable = "avx512f")]
fn shard([x, y, z]: [__m512i; 3]) -> __m512i {
    let color = _mm512_slli_epi64::<2>(_mm512_add_epi64(y, z));
    let color = _mm512_add_epi64(color, _mm512_add_epi64(x, z));
    _mm512_and_si512(color, _mm512_set1_epi64(SHARDS as i64 - 1))
}
