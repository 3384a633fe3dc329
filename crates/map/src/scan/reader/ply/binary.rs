//! Binary elements of `.ply` files, of either byte order.

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType,
    ScalarType,
};

use super::header::{Element, Header, Kind, Property, Type};
use super::vertex::{Vertex, before_vertex};
use crate::scan::reader::coordinates::Coordinates;
use crate::scan::reader::count::check_count;
use crate::scan::reader::error::{Problem, quoted};

/// Names of the coordinates' properties while they are read.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The points of a binary payload of either byte order.
pub(super) fn points<C: Coordinates>(
    header: &Header,
    vertex: &Vertex<'_>,
    mut payload: &[u8],
) -> Result<Vec<C>, Problem> {
    for element in before_vertex(header) {
        let definition = definition(element, |_| None)?;
        check(&definition, payload.len())?;
        for i in 0..element.count {
            entry::<Skipped>(header.encoding, &definition, &mut payload, i)?;
        }
    }
    let definition = definition(vertex.element, |place| vertex.axis(place))?;
    check(&definition, payload.len())?;
    let point = |i| entry::<Read>(header.encoding, &definition, &mut payload, i);
    (0..definition.count).map(point).map(|read| read.map(|point| C::of_doubles(point.0))).collect()
}

/// An element as ply-rs-bw reads it: what is no coordinate has its number for a name.
fn definition(element: &Element, axis: impl Fn(usize) -> Option<usize>) -> Result<ElementDef, Problem> {
    let mut definition = ElementDef::new(element.name.clone());
    definition.count = element.count;
    for (place, property) in element.properties.iter().enumerate() {
        let name = axis(place).map_or_else(|| place.to_string(), |axis| AXES[axis].to_owned());
        definition.properties.add(PropertyDef::new(name, type_of(property)?));
    }
    Ok(definition)
}

/// The type of a property. One that is only skipped is any of as many bytes.
fn type_of(property: &Property) -> Result<PropertyType, Problem> {
    let scalar = |value: &Type| match value {
        Type::Known(scalar) => Ok(scalar.clone()),
        Type::Wide(2) => Ok(ScalarType::UShort),
        Type::Wide(_) => Ok(ScalarType::Double),
        Type::Unknown(_) => Err(property.problem(format!("type {value} is not known, so its bytes are not"))),
    };
    match &property.kind {
        Kind::Scalar(value) => scalar(value).map(PropertyType::Scalar),
        Kind::List(Type::Wide(_), _) => Err(property.problem(format!("it is {}", property.kind))),
        Kind::List(length, value) => Ok(PropertyType::List(scalar(length)?, scalar(value)?)),
    }
}

/// Checks the count of an element against the bytes that follow.
fn check(element: &ElementDef, have: usize) -> Result<(), Problem> {
    let types = element.properties.values().map(|property| &property.data_type);
    let bytes = types.map(bytes_min).sum();
    check_count(&format!("{} elements", quoted(&element.name)), element.count as u64, bytes, have)
}

/// Fewest bytes that a property takes; a list may be empty.
fn bytes_min(data_type: &PropertyType) -> u64 {
    let (PropertyType::Scalar(scalar) | PropertyType::List(scalar, _)) = data_type;
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// Reads entry `index` of `element` from the front of `payload`.
fn entry<E: PropertyAccess>(
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
struct Read([f64; 3]);

impl PropertyAccess for Read {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    #[inline]
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set_double(name, f64::from(value))
    }

    #[inline]
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let Some(axis) = AXES.iter().position(|axis| *axis == name) else {
            return PropertyAccessResult::Ignored;
        };
        self.0[axis] = value;
        PropertyAccessResult::Set
    }
}

/// An entry of an element before `vertex`.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
