//! The element `vertex`, and the elements before it.

use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyType, ScalarType};

use crate::scan::reader::count::check_count;
use crate::scan::reader::error::{Problem, quoted};

pub(super) const VERTEX: &str = "vertex";

/// Fewest bytes of one ascii value: a digit and a separator.
const ASCII_VALUE_BYTES_MIN: u64 = 2;

/// Element `vertex`, which has x, y and z as float or double.
pub(super) fn vertex(header: &Header) -> Result<&ElementDef, Problem> {
    let vertex =
        header.elements.get(VERTEX).ok_or_else(|| Problem::new("no element vertex in the header"))?;
    for name in ["x", "y", "z"] {
        match vertex.properties.get(name).map(|property| &property.data_type) {
            Some(PropertyType::Scalar(ScalarType::Float | ScalarType::Double)) => {}
            Some(other) => {
                return Err(Problem::new(format!(
                    "property {name} of element vertex is {other:?}, float or double is needed"
                )));
            }
            None => return Err(Problem::new(format!("element vertex has no property {name}"))),
        }
    }
    Ok(vertex)
}

/// The elements before `vertex`, whose entries lie before its own.
pub(super) fn before_vertex(header: &Header) -> impl Iterator<Item = &ElementDef> {
    header.elements.values().take_while(|element| element.name != VERTEX)
}

pub(super) fn check_element(element: &ElementDef, encoding: Encoding, have: usize) -> Result<(), Problem> {
    let types = element.properties.values().map(|property| &property.data_type);
    let entry_bytes = types.map(|data_type| value_bytes_min(data_type, encoding)).sum();
    check_count(&format!("{} elements", quoted(&element.name)), element.count as u64, entry_bytes, have)
}

/// Fewest bytes that a property takes; a list may be empty.
fn value_bytes_min(data_type: &PropertyType, encoding: Encoding) -> u64 {
    let (PropertyType::Scalar(scalar) | PropertyType::List(scalar, _)) = data_type;
    match scalar {
        _ if encoding == Encoding::Ascii => ASCII_VALUE_BYTES_MIN,
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}
