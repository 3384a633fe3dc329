//! Many keys at once into a filter that nobody reads yet: most of what a map does that grows.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod scalar;

pub(super) use dispatch::fill;
