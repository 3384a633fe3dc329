//! Points of `.ply` files: the x, y, z of element `vertex`.
//!
//! Programs write names and comments that the grammar of ply-rs-bw refuses, and numbers too (`nan`, `inf`, `.5`, `5.`),
//! so headers and text are read here; ply-rs-bw reads the binary elements.

mod ascii;
mod binary;
mod file;
mod header;
mod vertex;

pub(super) use file::points;
