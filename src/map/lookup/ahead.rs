//! Memory asked for before it is needed.
#![expect(unsafe_code, reason = "a prefetch is an intrinsic")]

/// Starts fetching what `value` lies in, to be changed soon. Elsewhere than on x86-64 it does nothing.
#[inline(always)]
pub(in crate::map) fn fetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch reads nothing that the program sees.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>((&raw const *value).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
