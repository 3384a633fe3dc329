//! Points of `.ply` files: the x, y, z of element `vertex`.
//!
//! ply-rs-bw reads the header and the binary elements.

mod ascii;
mod binary;
mod file;
mod vertex;

pub(super) use file::points;
