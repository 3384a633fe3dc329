//! The critical path of everything (paper II): rotate, translate, quantize, look up.
//!
//! One operation: points and a pose in, a bit a point out. `scalar` defines it; the SIMD variants agree with it
//! bit for bit and are chosen at run time.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod by_key;
mod by_point;
mod level_view;
mod scalar;
#[cfg(test)]
mod tests;

pub use by_key::filter_contains;
pub use by_point::occupied_scalar;
pub(super) use by_point::{count, occupied};
pub use level_view::{LevelView, Lookup};
