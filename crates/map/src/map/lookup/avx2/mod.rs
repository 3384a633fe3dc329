//! The look-up eight points at a time, for machines with AVX2 and without AVX-512.
//!
//! Every step does the same as one of [`super::scalar`]. A batch of points takes each step together: where the
//! voxels are, what to fetch for them, what is there; so the misses of a whole batch are on their way at once.
#![expect(unsafe_code, reason = "vector intrinsics and gathers from raw addresses")]

mod bloom;
pub(super) mod by_key;
mod by_point;
mod exact;
mod kernel;
mod locate;
mod registers;

pub(super) use by_point::occupied;
