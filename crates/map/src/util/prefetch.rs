//! Memory asked for before it is needed.

/// Starts fetching the line that begins `at`, or lies around it. Any address will do: a prefetch never faults.
/// Elsewhere than on x86-64 it does nothing.
///
/// Into the second cache, not the first: of the misses of that one some two dozen can be under way (Zen 4), and
/// whatever is fetched beyond those waits, the look-ups behind it as well (by the filter of a large map, at random, 8.2
/// ns a point instead of 4.1).
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "a prefetch is an intrinsic"))]
#[inline(always)]
pub fn prefetch<T>(at: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch reads nothing that the program sees.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T1>(at.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = at;
}
