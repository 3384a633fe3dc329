//! Offsets of points in a dense array, with SIMD variants as of the map's own look-up, so that the rival gets the same
//! transform.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;

pub use dispatch::offsets;
