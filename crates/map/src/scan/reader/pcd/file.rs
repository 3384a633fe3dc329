//! A `.pcd` file: its header, and the points that follow.

use super::header::{DataKind, Header};
use super::{ascii, binary};
use crate::scan::reader::coordinates::Coordinates;
use crate::scan::reader::error::Problem;

/// The points of a `.pcd` file. Its viewpoint is ignored: the pose of a scan is given with the scan.
pub(in crate::scan::reader) fn points<C: Coordinates>(bytes: &[u8]) -> Result<Vec<C>, Problem> {
    let (header, data) = Header::take(bytes)?;
    match header.data {
        DataKind::Ascii => ascii::points(&header, data),
        DataKind::Binary | DataKind::BinaryCompressed => binary::points(&header, data.rest()),
    }
}
