//! The probe of the counting Bloom filter.

use std::arch::x86_64::*;

use super::kernel::{BATCH, Batch, LookupKernel};
use super::registers::{of_shards, prefetch, store};
use crate::bloom::{BITS_OF_HASH, HASH_BITS, HASH_MIX, HASH_NEXT, HASH_WORD};
use crate::map::lookup::level_view::LevelView;
use crate::map::shards::SHARDS;
use crate::voxel::quantize::avx2::LANES;

/// The bit planes: address and words of each shard's.
pub(super) struct Planes {
    addresses: [u64; SHARDS],
    words: [i32; SHARDS],
    hashes: u32,
}

impl Planes {
    pub(super) fn of(view: &LevelView<'_>) -> Self {
        Self {
            addresses: view.planes.map(|plane| plane.as_ptr().expose_provenance() as u64),
            words: view.planes.map(|plane| plane.len() as u32 as i32),
            hashes: view.hashes,
        }
    }
}

impl LookupKernel for Planes {
    #[target_feature(enable = "avx2")]
    unsafe fn look_up(&self, batch: &Batch, points: usize) -> [u64; BATCH / 64] {
        let (mut addresses, mut bits) = ([0u64; BATCH], [0u32; BATCH]);
        for at in (0..points).step_by(LANES) {
            let halves = halves(batch, at);
            let word = self.words(sum_of(halves, HASH_WORD), &batch.shard, at);
            let [first, second] = [
                _mm256_cvtepu32_epi64(_mm256_castsi256_si128(word)),
                _mm256_cvtepu32_epi64(_mm256_extracti128_si256::<1>(word)),
            ];
            for (at, word) in [(at, first), (at + 4, second)] {
                let plane = of_shards(&self.addresses, &batch.shard, at);
                store(&mut addresses[at..], _mm256_add_epi64(plane, _mm256_slli_epi64::<3>(word)));
            }
            // SAFETY: eight u32 are one register.
            unsafe {
                _mm256_storeu_si256(bits[at..at + LANES].as_mut_ptr().cast(), sum_of(halves, HASH_BITS))
            };
            addresses[at..at + LANES].iter().for_each(|&address| prefetch(address));
        }
        let mut hits = [0; BATCH / 64];
        for at in (0..points).step_by(4) {
            // SAFETY: four u64 are one register and four u32 half of one; each address is of a word of a shard's
            // plane, which the view keeps alive, for lanes past the last point were located with it.
            let (words, mask) = unsafe {
                let address = _mm256_loadu_si256(addresses[at..at + 4].as_ptr().cast());
                let g = _mm256_cvtepu32_epi64(_mm_loadu_si128(bits[at..at + 4].as_ptr().cast()));
                (_mm256_i64gather_epi64::<1>(std::ptr::null(), address), self.masks(g))
            };
            let hit = _mm256_cmpeq_epi64(_mm256_and_si256(words, mask), mask);
            hits[at / 64] |= (_mm256_movemask_pd(_mm256_castsi256_pd(hit)) as u64) << (at % 64);
        }
        hits
    }
}

impl Planes {
    /// Eight words of the planes, from the sums that they follow from.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn words(&self, u: __m256i, shard: &[i32; BATCH], at: usize) -> __m256i {
        let h = _mm256_xor_si256(u, _mm256_srli_epi32::<16>(u));
        let h = _mm256_mullo_epi32(h, _mm256_set1_epi32(HASH_MIX as i32));
        // SAFETY: eight i32 from `at` on, each below the number of shards.
        let words = unsafe {
            let shard = _mm256_loadu_si256(shard[at..at + LANES].as_ptr().cast());
            _mm256_i32gather_epi32::<4>(self.words.as_ptr(), shard)
        };
        let odd = |lanes: __m256i| _mm256_srli_epi64::<32>(lanes);
        let second = _mm256_mul_epu32(odd(h), odd(words));
        _mm256_blend_epi32::<0b1010_1010>(odd(_mm256_mul_epu32(h, words)), second)
    }

    /// The bits of a word that are set where a key is present, of whose hash the low halves are `g`.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn masks(&self, g: __m256i) -> __m256i {
        let one = _mm256_set1_epi64x(1);
        let mut mask = _mm256_setzero_si256();
        let mut bits = _mm256_slli_epi64::<32>(g);
        for i in 0..self.hashes {
            if i == BITS_OF_HASH {
                let next = _mm256_mul_epu32(g, _mm256_set1_epi64x(i64::from(HASH_NEXT)));
                bits = _mm256_slli_epi64::<32>(next);
            }
            mask = _mm256_or_si256(mask, _mm256_sllv_epi64(one, _mm256_srli_epi64::<58>(bits)));
            bits = _mm256_slli_epi64::<6>(bits);
        }
        mask
    }
}

/// Low and high halves of the packed keys (`VoxelKey::pack`) of eight voxels.
#[inline]
#[target_feature(enable = "avx2")]
fn halves(batch: &Batch, at: usize) -> [__m256i; 2] {
    let field = _mm256_set1_epi32(0x1f_ffff);
    let [x, y, z] = batch.index.each_ref().map(|index| {
        // SAFETY: eight i32 are one register.
        let index = unsafe { _mm256_loadu_si256(index[at..at + LANES].as_ptr().cast()) };
        _mm256_and_si256(index, field)
    });
    let low = _mm256_or_si256(x, _mm256_slli_epi32::<21>(y));
    [low, _mm256_or_si256(_mm256_srli_epi32::<11>(y), _mm256_slli_epi32::<10>(z))]
}

/// low * by[0] + high * by[1], in 32 bits.
#[inline]
#[target_feature(enable = "avx2")]
fn sum_of([low, high]: [__m256i; 2], by: [u32; 2]) -> __m256i {
    let times = |half: __m256i, by: u32| _mm256_mullo_epi32(half, _mm256_set1_epi32(by as i32));
    _mm256_add_epi32(times(low, by[0]), times(high, by[1]))
}
