//! Arithmetic on registers of four 64-bit lanes, and what they load and store.

use std::arch::x86_64::*;

use super::kernel::BATCH;
use crate::map::shards::SHARDS;
use crate::util;
use crate::voxel::quantize::avx2::pack_four;

/// Four packed keys (`VoxelKey::pack`) of the voxels from `at` on.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn pack(index: &[[i32; BATCH]; 3], at: usize) -> __m256i {
    // SAFETY: four i32 from `at` on; `at` is a multiple of four below the batch's size.
    pack_four([0, 1, 2].map(|axis| unsafe { _mm_loadu_si128(index[axis][at..at + 4].as_ptr().cast()) }))
}

/// The low 64 bits of each product; AVX2 multiplies 32 bits by 32 bits.
#[inline]
#[target_feature(enable = "avx2")]
fn multiply(a: __m256i, b: u64) -> __m256i {
    let (low, high) = (_mm256_set1_epi64x(b as i64), _mm256_set1_epi64x((b >> 32) as i64));
    let cross =
        _mm256_add_epi64(_mm256_mul_epu32(_mm256_srli_epi64::<32>(a), low), _mm256_mul_epu32(a, high));
    _mm256_add_epi64(_mm256_mul_epu32(a, low), _mm256_slli_epi64::<32>(cross))
}

/// The mix of the table (`Slots::home`).
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn mix(key: __m256i, a: u64, b: u64) -> __m256i {
    let h = multiply(key, a);
    multiply(_mm256_xor_si256(h, _mm256_srli_epi64::<32>(h)), b)
}

/// high32(h) * n >> 32.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn scale(h: __m256i, n: __m256i) -> __m256i {
    _mm256_srli_epi64::<32>(_mm256_mul_epu32(_mm256_srli_epi64::<32>(h), n))
}

/// One value a shard for each of the four voxels from `at` on.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn of_shards(values: &[u64; SHARDS], shard: &[i32; BATCH], at: usize) -> __m256i {
    // SAFETY: four i32 from `at` on, each below the number of shards.
    unsafe {
        let shard = _mm_loadu_si128(shard[at..at + 4].as_ptr().cast());
        _mm256_i32gather_epi64::<8>(values.as_ptr().cast(), shard)
    }
}

/// The four lanes in memory.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store(to: &mut [u64], lanes: __m256i) {
    debug_assert!(to.len() >= 4);
    // SAFETY: four u64 are one register, and `to` has room for them.
    unsafe { _mm256_storeu_si256(to[..4].as_mut_ptr().cast(), lanes) };
}

/// Starts fetching the line at an address.
#[inline(always)]
pub(super) fn prefetch(address: u64) {
    util::prefetch::<u64>(std::ptr::with_exposed_provenance(address as usize));
}
