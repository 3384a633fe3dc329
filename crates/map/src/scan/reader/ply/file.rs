//! A `.ply` file: its header, and the points that follow.

use ply_rs_bw::ply::Encoding;

use super::header::Header;
use super::vertex::Vertex;
use super::{ascii, binary};
use crate::scan::reader::coordinates::Coordinates;
use crate::scan::reader::error::Problem;

/// The points of a `.ply` file.
pub(in crate::scan::reader) fn points<C: Coordinates>(bytes: &[u8]) -> Result<Vec<C>, Problem> {
    let (header, payload) = Header::take(bytes)?;
    let vertex = Vertex::of(&header)?;
    match header.encoding {
        Encoding::Ascii => ascii::points(&header, &vertex, payload),
        _ => binary::points(&header, &vertex, payload.rest()),
    }
}
