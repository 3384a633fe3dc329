//! The look-up sixteen points at a time, for machines with AVX-512 F, BW, DQ and CD.
//!
//! Every step does the same as one of [`super::scalar`]: the same f32 operations in the same order, the same
//! hashes. Shard descriptors stay in registers; the only memory touched a point is its word of the plane, or of
//! its block's mask.
#![expect(unsafe_code, reason = "vector intrinsics and gathers from raw addresses")]

mod bloom;
pub(super) mod by_key;
mod by_point;
mod exact;
mod kernel;
mod locate;
mod registers;
mod tables;

pub(super) use by_point::occupied;
