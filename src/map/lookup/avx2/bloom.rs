//! The probe of the counting Bloom filter.

use std::arch::x86_64::*;

use super::{BATCH, Batch, Probe, mix, of_shards, pack, prefetch, scale, store};
use crate::bloom::{HASH_A, HASH_B, HASH_C};
use crate::map::lookup::LevelView;
use crate::map::sharding::SHARDS;

/// The bit planes: address and words of each shard's.
pub(super) struct Planes {
    addresses: [u64; SHARDS],
    words: [u64; SHARDS],
    hashes: u32,
}

impl Planes {
    pub(super) fn of(view: &LevelView<'_>) -> Self {
        Self {
            addresses: view.planes.map(|plane| plane.as_ptr().expose_provenance() as u64),
            words: view.planes.map(|plane| plane.len() as u64),
            hashes: view.hashes,
        }
    }
}

impl Probe for Planes {
    #[target_feature(enable = "avx2")]
    unsafe fn look_up(&self, batch: &Batch, points: usize) -> [u64; BATCH / 64] {
        let (mut addresses, mut masks) = ([0u64; BATCH], [0u64; BATCH]);
        let lanes = (0..points.next_multiple_of(4)).step_by(4);
        for at in lanes.clone() {
            let h = mix(pack(&batch.index, at), HASH_A, HASH_B);
            let word = scale(h, of_shards(&self.words, &batch.shard, at));
            let plane = of_shards(&self.addresses, &batch.shard, at);
            store(&mut addresses[at..], _mm256_add_epi64(plane, _mm256_slli_epi64::<3>(word)));
            store(&mut masks[at..], self.masks(h));
            addresses[at..at + 4].iter().for_each(|&address| prefetch(address));
        }
        let mut hits = [0; BATCH / 64];
        for at in lanes {
            // SAFETY: four u64 are one register; each address is of a word of a shard's plane, which the view keeps
            // alive.
            let (words, mask) = unsafe {
                let address = _mm256_loadu_si256(addresses[at..at + 4].as_ptr().cast());
                let mask = _mm256_loadu_si256(masks[at..at + 4].as_ptr().cast());
                (_mm256_i64gather_epi64::<1>(std::ptr::null(), address), mask)
            };
            let hit = _mm256_cmpeq_epi64(_mm256_and_si256(words, mask), mask);
            hits[at / 64] |= (_mm256_movemask_pd(_mm256_castsi256_pd(hit)) as u64) << (at % 64);
        }
        hits
    }
}

impl Planes {
    /// The bits of a word that are set where the key of hash `h` is present.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn masks(&self, h: __m256i) -> __m256i {
        let one = _mm256_set1_epi64x(1);
        let mut g = _mm256_mul_epu32(h, _mm256_set1_epi64x(HASH_C as i64));
        let mut mask = _mm256_sllv_epi64(one, _mm256_srli_epi64::<58>(g));
        for _ in 1..self.hashes {
            g = _mm256_slli_epi64::<6>(g);
            mask = _mm256_or_si256(mask, _mm256_sllv_epi64(one, _mm256_srli_epi64::<58>(g)));
        }
        mask
    }
}
