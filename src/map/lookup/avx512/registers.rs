//! What both probes do with eight or sixteen lanes: keys, hashes, descriptors of shards, memory.

use std::arch::x86_64::*;

use super::LANES;
use crate::map::sharding::SHARDS;

const _: () = assert!(SHARDS == LANES, "descriptors of all shards fill two registers of eight");

/// A value in all eight lanes, for what is made before the features are known to be there.
pub(super) const fn eight_of(value: u64) -> __m512i {
    // SAFETY: eight u64 are one register.
    unsafe { std::mem::transmute::<[u64; 8], __m512i>([value; 8]) }
}

#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn lanes(values: &[i32; LANES]) -> __m512i {
    // SAFETY: sixteen i32 are one register.
    unsafe { _mm512_loadu_si512(values.as_ptr().cast()) }
}

/// Sixteen packed keys (`VoxelKey::pack`), eight a register.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn pack(index: [__m512i; 3]) -> [__m512i; 2] {
    let field = _mm512_set1_epi32(0x1f_ffff);
    let [x, y, z] = index.map(|i| _mm512_and_si512(i, field));
    let low = _mm512_or_si512(x, _mm512_slli_epi32::<21>(y));
    let high = _mm512_or_si512(_mm512_srli_epi32::<11>(y), _mm512_slli_epi32::<10>(z));
    const FIRST: [i32; LANES] = [0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23];
    const SECOND: [i32; LANES] = [8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31];
    [FIRST, SECOND].map(|index| _mm512_permutex2var_epi32(low, lanes(&index), high))
}

/// Sixteen u32 as u64, eight a register.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn widen(values: __m512i) -> [__m512i; 2] {
    [
        _mm512_cvtepu32_epi64(_mm512_castsi512_si256(values)),
        _mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64::<1>(values)),
    ]
}

/// high32(mix(key)) and mix(key), for the mix of both the filter and the table.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
pub(super) fn mix(key: __m512i, a: u64, b: u64) -> __m512i {
    let h = _mm512_mullo_epi64(key, _mm512_set1_epi64(a as i64));
    let h = _mm512_xor_si512(h, _mm512_srli_epi64::<32>(h));
    _mm512_mullo_epi64(h, _mm512_set1_epi64(b as i64))
}

/// high32(h) * n >> 32.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn scale(h: __m512i, n: __m512i) -> __m512i {
    _mm512_srli_epi64::<32>(_mm512_mul_epu32(_mm512_srli_epi64::<32>(h), n))
}

/// One u64 a shard, in two registers.
#[derive(Clone, Copy)]
pub(super) struct PerShard([__m512i; 2]);

impl PerShard {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(values: [u64; SHARDS]) -> Self {
        // SAFETY: eight u64 are one register.
        unsafe { Self([0, 8].map(|i| _mm512_loadu_si512(values[i..].as_ptr().cast()))) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn of(self, shard: __m512i) -> __m512i {
        _mm512_permutex2var_epi64(self.0[0], shard, self.0[1])
    }
}

pub(super) fn addresses<T>(slices: [&[T]; SHARDS]) -> [u64; SHARDS] {
    slices.map(|slice| slice.as_ptr().expose_provenance() as u64)
}

pub(super) fn lengths<T>(slices: [&[T]; SHARDS]) -> [u64; SHARDS] {
    slices.map(|slice| slice.len() as u64)
}

/// Starts fetching the lines at eight addresses.
///
/// # Safety
/// Needs AVX-512 F. Any address will do: a prefetch never faults.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) unsafe fn prefetch(addresses: __m512i) {
    let mut each = [0u64; 8];
    // SAFETY: a register is eight u64.
    unsafe {
        _mm512_storeu_si512(each.as_mut_ptr().cast(), addresses);
        for address in each {
            _mm_prefetch::<_MM_HINT_T0>(std::ptr::with_exposed_provenance(address as usize));
        }
    }
}

/// The u64 at each of eight addresses, by eight loads: on Zen 4 the instruction that gathers takes twice as long
/// (a look-up by the filter 2.4 ns instead of 2.0).
///
/// # Safety
/// Needs AVX-512 F; each address must be of a u64 that may be read.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) unsafe fn gather(addresses: __m512i) -> __m512i {
    let mut each = [std::ptr::null::<f64>(); 8];
    // SAFETY: a register is eight addresses, and they are of words that may be read.
    unsafe {
        _mm512_storeu_si512(each.as_mut_ptr().cast(), addresses);
        let pair = |i: usize| _mm_loadh_pd(_mm_load_sd(each[i]), each[i + 1]);
        let four = |i: usize| _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(pair(i)), pair(i + 2));
        _mm512_castpd_si512(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(four(0)), four(4)))
    }
}

/// Eight of `values` from the `first` on.
///
/// # Panics
/// When there are not as many.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn load(values: &[u64], first: usize) -> __m512i {
    // SAFETY: eight u64 are one register.
    unsafe { _mm512_loadu_si512(values[first..first + 8].as_ptr().cast()) }
}

/// The inverse of [`load`].
///
/// # Panics
/// As for that.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn store(values: &mut [u64], first: usize, register: __m512i) {
    // SAFETY: eight u64 are one register.
    unsafe { _mm512_storeu_si512(values[first..first + 8].as_mut_ptr().cast(), register) }
}

#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn to_array(register: __m512i) -> [u64; 8] {
    let mut array = [0; 8];
    // SAFETY: eight u64 are one register.
    unsafe { _mm512_storeu_si512(array.as_mut_ptr().cast(), register) };
    array
}
