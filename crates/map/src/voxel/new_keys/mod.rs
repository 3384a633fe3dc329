//! The voxels that a block gains, as keys, level by level.

#[cfg(target_arch = "x86_64")]
mod append;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod scalar;
