//! Points of `.ply` files: the x, y, z of element `vertex`.
//!
//! Programs write names and comments that the grammar of ply-rs-bw refuses, and numbers too (`nan`, `inf`, `.5`, `5.`), so
//! headers and text are read here; ply-rs-bw reads the binary elements.

mod ascii;
mod binary;
mod header;
mod vertex;

use ply_rs_bw::ply::Encoding;

use super::coordinates::Coordinates;
use super::error::Problem;
use header::Header;
use vertex::Vertex;

/// The points of a `.ply` file.
pub(super) fn points<C: Coordinates>(bytes: &[u8]) -> Result<Vec<C>, Problem> {
    let (header, payload) = Header::take(bytes)?;
    let vertex = Vertex::of(&header)?;
    match header.encoding {
        Encoding::Ascii => ascii::points(&header, &vertex, payload),
        _ => binary::points(&header, &vertex, payload.rest()),
    }
}
