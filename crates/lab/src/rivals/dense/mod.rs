//! A dense array of bytes: the paper's upper limit to query speed.

mod array;
mod grid;
mod offsets;

pub use array::{DENSE_BYTES_MAX, Dense, DenseTooLarge};
pub use grid::Grid;
pub use offsets::offsets;
