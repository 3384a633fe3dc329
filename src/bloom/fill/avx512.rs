//! What [`super::avx2`] does, compiled for AVX-512: probes of sixteen keys are made at once.
#![expect(unsafe_code, reason = "a function that is compiled for more than the crate is")]

use super::avx2;
use crate::bloom::counters::Counters;

/// True when the machine can run this module.
pub(super) fn is_available() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512vl")
}

/// See [`super::fill`]. Must only be called where [`is_available`].
pub(super) fn fill(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
    #[target_feature(enable = "avx2,avx512f,avx512dq,avx512bw,avx512vl")]
    fn with_avx512(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
        // SAFETY: the features are there.
        unsafe { avx2::fill_inline(plane, counters, hashes, keys) }
    }
    debug_assert!(is_available());
    // SAFETY: the caller checked for the features, of which AVX2 is a part.
    unsafe { with_avx512(plane, counters, hashes, keys) }
}
