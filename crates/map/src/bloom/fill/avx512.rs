//! What [`super::avx2`] does, compiled for AVX-512: probes of sixteen keys are made at once.
#![expect(unsafe_code, reason = "a function that is compiled for more than the crate is")]

use super::avx2;
use crate::bloom::counters::Counters;
use crate::util::cpu::Avx512;

/// See [`super::fill`].
pub(super) fn fill(_: Avx512, plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
    #[target_feature(enable = "avx2,avx512f,avx512dq,avx512bw,avx512vl")]
    fn with_avx512(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
        // SAFETY: the features are there.
        unsafe { avx2::fill_inline(plane, counters, hashes, keys) }
    }
    // SAFETY: the token says that the CPU has the features, of which AVX2 is a part.
    unsafe { with_avx512(plane, counters, hashes, keys) }
}
