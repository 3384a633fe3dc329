//! Points of `.pcd` files: the fields x, y, z.
//!
//! Programs write headers that pcd-rs refuses or takes otherwise (a field of count 0, no line POINTS, names in
//! capitals), and it allocates, and indexes, by the counts that a header declares. So the header is read here and
//! checked against the bytes that follow; pcd-rs reads binary points, from a plain header that says the same.

mod ascii;
mod binary;
mod file;
mod header;

pub(super) use file::points;
