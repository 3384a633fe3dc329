//! Binary elements of `.ply` files, of either byte order.

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult};

use super::vertex::{before_vertex, check_element};
use crate::geometry::Point;
use crate::scan::reader::axis::axis;
use crate::scan::reader::error::{Problem, quoted};

/// The points of a binary payload of either byte order.
pub(super) fn points(
    header: &Header,
    vertex: &ElementDef,
    mut payload: &[u8],
) -> Result<Vec<Point>, Problem> {
    for element in before_vertex(header) {
        check_element(element, header.encoding, payload.len())?;
        for i in 0..element.count {
            read_binary::<Skipped>(header.encoding, element, &mut payload, i)?;
        }
    }
    check_element(vertex, header.encoding, payload.len())?;
    (0..vertex.count)
        .map(|i| read_binary::<Vertex>(header.encoding, vertex, &mut payload, i).map(|v| Point::from(v.0)))
        .collect()
}

/// Reads entry `index` of `element` from the front of `payload`.
fn read_binary<E: PropertyAccess>(
    encoding: Encoding,
    element: &ElementDef,
    payload: &mut &[u8],
    index: usize,
) -> Result<E, Problem> {
    let parser = Parser::<E>::new();
    let read = match encoding {
        Encoding::BinaryBigEndian => parser.read_big_endian_element(payload, element),
        _ => parser.read_little_endian_element(payload, element),
    };
    read.map_err(|error| {
        Problem::new(format!("element {} {index} of {}: {error}", quoted(&element.name), element.count))
    })
}

/// A vertex while it is read; what is not x, y or z is ignored.
pub(super) struct Vertex([f32; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f32::NAN; 3])
    }

    #[inline]
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        let Some(axis) = axis(name) else {
            return PropertyAccessResult::Ignored;
        };
        self.0[axis] = value;
        PropertyAccessResult::Set
    }

    #[inline]
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set_float(name, value as f32)
    }
}

/// An entry of an element before `vertex`.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
