//! All counters of a word of the plane in one register: a bit of a key's mask adds one to its half of a byte.
#![expect(unsafe_code, reason = "vector intrinsics")]

use std::arch::x86_64::*;

use super::AT_ONCE;
use crate::ahead::fetch;
use crate::bloom::Probe;
use crate::bloom::counters::{COUNTER_MAX, Counters};

/// The bits of a mask whose counters are the low halves of bytes, and the high ones.
const EVEN: u64 = 0x5555_5555_5555_5555;
const ODD: u64 = !EVEN;

/// True when the machine can run this module.
pub(super) fn is_available() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("bmi2")
}

/// See [`super::fill`]. Must only be called where [`is_available`].
pub(super) fn fill(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
    debug_assert!(is_available());
    // SAFETY: the caller checked for the features.
    unsafe {
        match hashes {
            // The default: no loop over hashes.
            2 => fill_with::<2>(plane, counters, hashes, keys),
            _ => fill_with::<0>(plane, counters, hashes, keys),
        }
    }
}

/// With `HASHES` hashes; 0 = as many as `hashes` says.
#[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,bmi2")]
fn fill_with<const HASHES: u32>(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
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
            fetch(counters.of_word(word));
            fetch(&plane[word]);
        }
        places.into_iter().zip(masks).for_each(|(word, mask)| add(plane, counters, Probe { word, mask }));
    }
    rest.iter().for_each(|&key| add(plane, counters, Probe::of(key, hashes, words)));
}

/// One key more at `probe`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,bmi2")]
fn add(plane: &mut [u64], counters: &mut Counters, Probe { word, mask }: Probe) {
    const _: () = assert!(COUNTER_MAX == 0xf, "a counter is half a byte");
    let halves = [0x0f, 0xf0_u8 as i8].map(|half| _mm256_set1_epi8(half));
    let ones = [0x01, 0x10].map(|one| _mm256_set1_epi8(one));
    let counters = counters.of_word_mut(word);
    // SAFETY: four u64 are one register.
    let now = unsafe { _mm256_loadu_si256((&raw const *counters).cast()) };
    // Those of the bits that do not hold their most.
    let counting = |bits: u64, half: __m256i| {
        _mm256_mask_cmpneq_epi8_mask(_pext_u64(mask, bits) as u32, _mm256_and_si256(now, half), half)
    };
    let after = _mm256_mask_add_epi8(now, counting(EVEN, halves[0]), now, ones[0]);
    let after = _mm256_mask_add_epi8(after, counting(ODD, halves[1]), after, ones[1]);
    // SAFETY: as above.
    unsafe { _mm256_storeu_si256((&raw mut *counters).cast(), after) };
    plane[word] |= mask;
}
