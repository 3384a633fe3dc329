//! Quantization (paper II): rotate, translate, scale and round down, from points to packed voxel keys.
//!
//! [`LatticeFromPoints::index`](super::LatticeFromPoints::index) defines it, point by point; [`keys`] does the same for
//! many points at once. The SIMD variants agree with the scalar one bit for bit: the same f32 operations in the same
//! order.

#[cfg(target_arch = "x86_64")]
pub mod avx2;
#[cfg(target_arch = "x86_64")]
pub mod avx512;
mod dispatch;
mod scalar;

pub use dispatch::keys;
pub use scalar::NO_KEY;
