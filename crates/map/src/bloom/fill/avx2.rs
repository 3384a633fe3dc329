//! All counters of a word of the plane in one register: a bit of a key's mask adds one to its half of a byte.
#![expect(unsafe_code, reason = "vector intrinsics")]

use std::arch::x86_64::*;

use super::scalar::AT_ONCE;
use crate::bloom::counters::{COUNTER_MAX, Counters};
use crate::bloom::probe::Probe;
use crate::util::cpu::Avx2;
use crate::util::prefetch;

/// See [`super::fill`].
pub(super) fn fill(_: Avx2, plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
    #[target_feature(enable = "avx2")]
    fn with_avx2(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
        // SAFETY: the feature is there.
        unsafe { fill_inline(plane, counters, hashes, keys) }
    }
    // SAFETY: the token says that the CPU has the feature.
    unsafe { with_avx2(plane, counters, hashes, keys) }
}

/// What it does, for callers with this and further features.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
pub(super) unsafe fn fill_inline(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
    // SAFETY: as for this function.
    unsafe {
        match hashes {
            // The default: no loop over hashes.
            2 => fill_with::<2>(plane, counters, hashes, keys),
            _ => fill_with::<0>(plane, counters, hashes, keys),
        }
    }
}

/// With `HASHES` hashes; 0 = as many as `hashes` says.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn fill_with<const HASHES: u32>(
    plane: &mut [u64],
    counters: &mut Counters,
    hashes: u32,
    keys: &[u64],
) {
    let (hashes, words) = (if HASHES == 0 { hashes } else { HASHES }, plane.len());
    let (sixteens, rest) = keys.as_chunks::<AT_ONCE>();
    for keys in sixteens {
        let (mut places, mut masks) = ([0; AT_ONCE], [0; AT_ONCE]);
        // Nothing but arithmetic, and each result in an array of its own: the compiler makes it wide.
        for i in 0..AT_ONCE {
            let probe = Probe::of(keys[i], hashes, words);
            (places[i], masks[i]) = (probe.word, probe.mask);
        }
        for &word in &places {
            prefetch(counters.of_word(word));
            prefetch(&plane[word]);
        }
        for (word, mask) in places.into_iter().zip(masks) {
            // SAFETY: as for this function.
            unsafe { add(plane, counters, Probe { word, mask }) };
        }
    }
    for &key in rest {
        // SAFETY: as for this function.
        unsafe { add(plane, counters, Probe::of(key, hashes, words)) };
    }
}

/// One key more at `probe`.
#[inline]
#[target_feature(enable = "avx2")]
fn add(plane: &mut [u64], counters: &mut Counters, Probe { word, mask }: Probe) {
    const _: () = assert!(COUNTER_MAX == 0xf, "a counter is half a byte");
    let counters = counters.of_word_mut(word);
    // SAFETY: four u64 are one register.
    let now = unsafe { _mm256_loadu_si256((&raw const *counters).cast()) };
    // For each byte of counters, of two bits of the mask each, the byte where these are.
    let bytes = _mm256_setr_epi64x(
        0x0101_0101_0000_0000,
        0x0303_0303_0202_0202,
        0x0505_0505_0404_0404,
        0x0707_0707_0606_0606,
    );
    let bytes = _mm256_shuffle_epi8(_mm256_set1_epi64x(mask as i64), bytes);
    // One where the bit is set whose counter is this half of the byte, and does not hold its most.
    let counting = |bits: i32, half: i8, one: i8| {
        let (bits, half) = (_mm256_set1_epi32(bits), _mm256_set1_epi8(half));
        let set = _mm256_cmpeq_epi8(_mm256_and_si256(bytes, bits), bits);
        let most = _mm256_cmpeq_epi8(_mm256_and_si256(now, half), half);
        _mm256_and_si256(_mm256_andnot_si256(most, set), _mm256_set1_epi8(one))
    };
    let low = counting(0x4010_0401, 0x0f, 0x01);
    let high = counting(0x8020_0802_u32 as i32, 0xf0_u8 as i8, 0x10);
    let after = _mm256_add_epi8(now, _mm256_or_si256(low, high));
    // SAFETY: as above.
    unsafe { _mm256_storeu_si256((&raw mut *counters).cast(), after) };
    plane[word] |= mask;
}
