//! Points of `.pcd` files: the fields x, y, z.
//!
//! Programs write headers that pcd-rs refuses or takes otherwise (a field of count 0, no line POINTS, names in capitals), and
//! it allocates, and indexes, by the counts that a header declares. So the header is read here and checked against
//! the bytes that follow; pcd-rs reads binary points, from a plain header that says the same.

mod ascii;
mod binary;
mod header;

use super::coordinates::Coordinates;
use super::error::Problem;
use header::{DataKind, Header};

/// The points of a `.pcd` file. Its viewpoint is ignored: the pose of a scan is given with the scan.
pub(super) fn points<C: Coordinates>(bytes: &[u8]) -> Result<Vec<C>, Problem> {
    let (header, data) = Header::take(bytes)?;
    match header.data {
        DataKind::Ascii => ascii::points(&header, data),
        DataKind::Binary | DataKind::BinaryCompressed => binary::points(&header, data.rest()),
    }
}
