//! The probe of the counting Bloom filter.

use std::arch::x86_64::*;

use super::kernel::{GROUPS, LookupKernel};
use super::registers::{Addresses, PerShard, addresses, eight_of, gather, lengths, odd, prefetch, sum_of};
use crate::bloom::{BITS_OF_HASH, HASH_BITS, HASH_MIX, HASH_NEXT, HASH_WORD};
use crate::map::lookup::level_view::LevelView;
use crate::voxel::quantize::avx512::{LANES, halves, lanes};

/// The counting Bloom filter with `HASHES` hashes; 0 = as many as the view says. With `FETCH`, words are fetched as
/// soon as they are located.
pub(super) struct Bloom<const HASHES: u32, const FETCH: bool>;

pub(super) struct BloomRegisters {
    plane: PerShard,
    words: __m512i,
    hashes: u32,
}

/// Sixteen keys on their way: those of even lanes first, where it is eight.
#[derive(Clone, Copy)]
pub(super) struct Located {
    /// Addresses of words of the planes.
    addresses: [Addresses; 2],
    /// Hashes from which the bits follow that count there.
    bits: __m512i,
}

impl Located {
    pub(super) const NONE: Self = Self { addresses: [Addresses::NONE; 2], bits: eight_of(0) };
}

impl<const HASHES: u32, const FETCH: bool> LookupKernel for Bloom<HASHES, FETCH> {
    type Registers<'a> = BloomRegisters;
    type Located = Located;
    type Word = [Located; GROUPS];
    type Memory = ();

    const AHEAD: usize = 2;
    const NO_WORD: Self::Word = [Located::NONE; GROUPS];

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn load(view: &LevelView<'_>) -> BloomRegisters {
        BloomRegisters::load(view)
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn locate(r: &BloomRegisters, index: [__m512i; 3], shard: __m512i, _: u16) -> Located {
        let located = r.locate(halves(index), shard);
        if FETCH {
            located.addresses.iter().for_each(prefetch);
        }
        located
    }

    /// Nothing is left to find out: neighbors' words lie apart.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn seek(
        _: &BloomRegisters,
        (): &mut (),
        located: [Located; GROUPS],
        word: &mut [Located; GROUPS],
    ) {
        *word = located;
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn answer(r: &BloomRegisters, (): &mut (), word: &[Located; GROUPS]) -> u64 {
        // SAFETY: as for this function.
        let answer =
            |group: usize| unsafe { u64::from(r.sixteen::<HASHES>(&word[group])) << (group * LANES) };
        answer(0) | answer(1) | answer(2) | answer(3)
    }
}

impl BloomRegisters {
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn load(view: &LevelView<'_>) -> Self {
        Self {
            plane: PerShard::load(addresses(view.planes)),
            words: lanes(&lengths(view.planes).map(|words| words as u32 as i32)),
            hashes: view.hashes,
        }
    }

    /// The SIMD variant of `bloom::Probe::of` for sixteen keys, given by halves.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) fn locate(&self, halves: [__m512i; 2], shard: __m512i) -> Located {
        let u = sum_of(halves, HASH_WORD);
        let h = _mm512_xor_si512(u, _mm512_srli_epi32::<16>(u));
        let h = _mm512_mullo_epi32(h, _mm512_set1_epi32(HASH_MIX as i32));
        let words = _mm512_permutexvar_epi32(shard, self.words);
        let address = |h: __m512i, words: __m512i, shard: __m512i| {
            let word = _mm512_srli_epi64::<32>(_mm512_mul_epu32(h, words));
            _mm512_add_epi64(self.plane.of(shard), _mm512_slli_epi64::<3>(word))
        };
        let addresses = [address(h, words, shard), address(odd(h), odd(words), odd(shard))];
        Located { addresses: addresses.map(|a| Addresses::of(a)), bits: sum_of(halves, HASH_BITS) }
    }

    /// A bit for each of sixteen keys: are all its bits set?
    ///
    /// # Safety
    /// Needs AVX-512 F; the view must still live.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn sixteen<const HASHES: u32>(&self, located: &Located) -> u16 {
        let hashes = if HASHES == 0 { self.hashes } else { HASHES };
        // SAFETY: each address is of a word of a shard's plane, which the view keeps alive.
        let [even, second] = located.addresses.each_ref().map(|a| unsafe { gather(a) });
        let (even, second) =
            (all_set(even, located.bits, hashes), all_set(second, odd(located.bits), hashes));
        const ODD: u16 = 0b1010_1010_1010_1010;
        let all = _mm512_mask_mov_epi32(even, ODD, _mm512_slli_epi64::<32>(second));
        _mm512_test_epi32_mask(all, _mm512_set1_epi32(1))
    }
}

/// Bit 0 of each of eight lanes: are the bits set in the word that the low half of `g` says?
#[inline]
#[target_feature(enable = "avx512f")]
fn all_set(word: __m512i, g: __m512i, hashes: u32) -> __m512i {
    // A rotation looks at six bits of its count: what lies above them may be anything.
    let rotated = |g: __m512i, i: u32| {
        _mm512_rorv_epi64(word, _mm512_srl_epi64(g, _mm_cvtsi32_si128((26 - 6 * i) as i32)))
    };
    let mut all = rotated(g, 0);
    for i in 1..hashes.min(BITS_OF_HASH) {
        all = _mm512_and_si512(all, rotated(g, i));
    }
    let next = _mm512_mul_epu32(g, _mm512_set1_epi64(i64::from(HASH_NEXT)));
    for i in BITS_OF_HASH..hashes {
        all = _mm512_and_si512(all, rotated(next, i - BITS_OF_HASH));
    }
    all
}
