//! What both probes do with eight or sixteen lanes: keys, hashes, descriptors of shards, memory.

use std::arch::x86_64::*;

use crate::map::shards::SHARDS;
use crate::util;
use crate::voxel::quantize::avx512::LANES;

const _: () = assert!(SHARDS == LANES, "descriptors of all shards fill two registers of eight");

/// A value in all eight lanes, for what is made before the features are known to be there.
pub(super) const fn eight_of(value: u64) -> __m512i {
    // SAFETY: eight u64 are one register.
    unsafe { std::mem::transmute::<[u64; 8], __m512i>([value; 8]) }
}

/// low * by[0] + high * by[1], in 32 bits.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn sum_of([low, high]: [__m512i; 2], by: [u32; 2]) -> __m512i {
    let times = |half: __m512i, by: u32| _mm512_mullo_epi32(half, _mm512_set1_epi32(by as i32));
    _mm512_add_epi32(times(low, by[0]), times(high, by[1]))
}

/// The odd ones of sixteen lanes, where the even ones were.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn odd(lanes: __m512i) -> __m512i {
    _mm512_srli_epi64::<32>(lanes)
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

/// The mix of the table of blocks (`Slots::home`).
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

/// Eight addresses in memory, from where they are fetched one by one.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Addresses([u64; 8]);

impl Addresses {
    pub(super) const NONE: Self = Self([0; 8]);

    /// One of the addresses, loaded. The compiler would rather take it out of the register that it was stored from,
    /// which is sooner known (so where one look-up waits for the other, [`gather_now`]) and is more work for the
    /// vectors.
    #[inline(always)]
    fn loaded<T>(&self, i: usize) -> *const T {
        // SAFETY: what is referred to may be read.
        let address = unsafe { std::ptr::read_volatile(&raw const self.0[i]) };
        std::ptr::with_exposed_provenance(address as usize)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn of(addresses: __m512i) -> Self {
        Self(to_array(addresses))
    }
}

/// Starts fetching the lines at eight addresses. Any address will do: a prefetch never faults.
#[inline(always)]
pub(super) fn prefetch(addresses: &Addresses) {
    (0..8).for_each(|i| util::prefetch(addresses.loaded::<u64>(i)));
}

/// Starts fetching the lines at eight addresses, which are taken from the register at once.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn prefetch_now(addresses: __m512i) {
    for address in to_array(addresses) {
        util::prefetch(std::ptr::with_exposed_provenance::<u64>(address as usize));
    }
}

/// The u64 at each of eight addresses, by eight loads: on Zen 4 the instruction that gathers takes twice as long
/// (a look-up by the filter 2.4 ns instead of 2.0).
///
/// # Safety
/// Needs AVX-512 F; each address must be of a u64 that may be read.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) unsafe fn gather(addresses: &Addresses) -> __m512i {
    // SAFETY: as for this function.
    unsafe { gather_from(|i| addresses.loaded(i)) }
}

/// [`gather`], with the addresses taken from the register at once.
///
/// # Safety
/// As for that.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) unsafe fn gather_now(addresses: __m512i) -> __m512i {
    let addresses = to_array(addresses);
    // SAFETY: as for this function.
    unsafe { gather_from(|i| std::ptr::with_exposed_provenance(addresses[i] as usize)) }
}

/// # Safety
/// Needs AVX-512 F; each address must be of a u64 that may be read.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn gather_from(at: impl Fn(usize) -> *const f64) -> __m512i {
    // SAFETY: the addresses are of words that may be read.
    unsafe {
        let pair = |i: usize| _mm_loadh_pd(_mm_load_sd(at(i)), at(i + 1));
        let four = |i: usize| _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(pair(i)), pair(i + 2));
        _mm512_castpd_si512(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(four(0)), four(4)))
    }
}

/// The two u64 at each of eight addresses: the first ones and the second ones.
///
/// # Safety
/// Needs AVX-512 F and DQ; each address must be of two u64 that may be read.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
pub(super) unsafe fn gather_pairs(addresses: __m512i) -> [__m512i; 2] {
    let addresses = to_array(addresses);
    // SAFETY: the addresses are of pairs that may be read.
    let four = |i: usize| unsafe {
        let pair =
            |i: usize| _mm_loadu_si128(std::ptr::with_exposed_provenance::<__m128i>(addresses[i] as usize));
        let four = _mm512_inserti64x2::<1>(_mm512_castsi128_si512(pair(i)), pair(i + 1));
        _mm512_inserti64x2::<3>(_mm512_inserti64x2::<2>(four, pair(i + 2)), pair(i + 3))
    };
    let (low, high) = (four(0), four(4));
    const FIRST: [u64; 8] = [0, 2, 4, 6, 8, 10, 12, 14];
    const SECOND: [u64; 8] = [1, 3, 5, 7, 9, 11, 13, 15];
    [FIRST, SECOND].map(|order| _mm512_permutex2var_epi64(low, load(&order, 0), high))
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
