//! The probe of the counting Bloom filter.

use std::arch::x86_64::*;

use super::registers::{PerShard, addresses, eight_of, gather, lengths, mix, pack, prefetch, scale, widen};
use super::{GROUPS, LANES, Probe};
use crate::bloom::{HASH_A, HASH_B, HASH_C};
use crate::map::lookup::LevelView;

/// The counting Bloom filter with `HASHES` hashes; 0 = as many as the view says. With `FETCH`, words are fetched as soon
/// as they are located.
pub(super) struct Bloom<const HASHES: u32, const FETCH: bool>;

pub(super) struct BloomRegisters {
    plane: PerShard,
    words: PerShard,
    pub(super) hashes: u32,
}

/// Addresses of words of the planes, and the bits that count there; eight voxels a register.
type Located = ([__m512i; 2], [__m512i; 2]);

impl<const HASHES: u32, const FETCH: bool> Probe for Bloom<HASHES, FETCH> {
    type Registers<'a> = BloomRegisters;
    type Located = Located;
    type Word = [Located; GROUPS];
    type Memory = ();

    const AHEAD: usize = 2;
    const NO_WORD: Self::Word = [([eight_of(0); 2], [eight_of(0); 2]); GROUPS];

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn load(view: &LevelView<'_>) -> BloomRegisters {
        BloomRegisters {
            plane: PerShard::load(addresses(view.planes)),
            words: PerShard::load(lengths(view.planes)),
            hashes: view.hashes,
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn locate(r: &BloomRegisters, index: [__m512i; 3], shard: __m512i, _: u16) -> Located {
        let (keys, shards) = (pack(index), widen(shard));
        let hashes = if HASHES == 0 { r.hashes } else { HASHES };
        let (a, b) = (r.word_of(keys[0], shards[0], hashes), r.word_of(keys[1], shards[1], hashes));
        if FETCH {
            // SAFETY: a prefetch never faults.
            unsafe {
                prefetch(a.0);
                prefetch(b.0);
            }
        }
        ([a.0, b.0], [a.1, b.1])
    }

    /// Nothing is left to find out: neighbours' words lie apart.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn seek(
        _: &BloomRegisters,
        (): &mut (),
        located: [Located; GROUPS],
        word: &mut [Located; GROUPS],
    ) {
        *word = located;
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd,popcnt")]
    unsafe fn answer(_: &BloomRegisters, (): &mut (), word: &[Located; GROUPS]) -> u64 {
        // SAFETY: as for this function.
        let answer = |group: usize| unsafe { u64::from(sixteen(&word[group])) << (group * LANES) };
        answer(0) | answer(1) | answer(2) | answer(3)
    }
}

/// # Safety
/// Needs AVX-512 F; the view must still live.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn sixteen((addresses, masks): &Located) -> u16 {
    // SAFETY: each address is of a word of a shard's plane, which the view keeps alive.
    let words = addresses.map(|a| unsafe { gather(a) });
    let hit = |half: usize| _mm512_cmpeq_epi64_mask(_mm512_and_si512(words[half], masks[half]), masks[half]);
    u16::from(hit(0)) | u16::from(hit(1)) << 8
}

impl BloomRegisters {
    /// The twin of `bloom::Probe::of` for eight keys: addresses of words, and masks.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    pub(super) fn word_of(&self, key: __m512i, shard: __m512i, hashes: u32) -> (__m512i, __m512i) {
        let h = mix(key, HASH_A, HASH_B);
        let word = scale(h, self.words.of(shard));
        let address = _mm512_add_epi64(self.plane.of(shard), _mm512_slli_epi64::<3>(word));
        let one = _mm512_set1_epi64(1);
        let mut g = _mm512_mul_epu32(h, _mm512_set1_epi64(HASH_C as i64));
        let mut mask = _mm512_sllv_epi64(one, _mm512_srli_epi64::<58>(g));
        for _ in 1..hashes {
            g = _mm512_slli_epi64::<6>(g);
            mask = _mm512_or_si512(mask, _mm512_sllv_epi64(one, _mm512_srli_epi64::<58>(g)));
        }
        (address, mask)
    }
}
