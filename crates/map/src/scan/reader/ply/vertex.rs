//! The element `vertex`, and the elements before it.

use ply_rs_bw::ply::ScalarType;

use super::header::{Element, Header, Kind, Type};
use crate::scan::reader::axis::{AxisProblem, axes};
use crate::scan::reader::error::Problem;

const VERTEX: &str = "vertex";

/// Element `vertex`, and which of its properties are x, y and z: each float or double.
pub(super) struct Vertex<'a> {
    pub(super) element: &'a Element,
    /// Places of x, y and z among its properties.
    pub(super) axes: [usize; 3],
}

impl<'a> Vertex<'a> {
    /// The element `vertex` of a header.
    pub(super) fn of(header: &'a Header) -> Result<Self, Problem> {
        let element = header.elements.iter().find(|element| element.name == VERTEX);
        let element = element.ok_or_else(|| Problem::new("no element vertex in the header"))?;
        let names: Vec<&str> = element.properties.iter().map(|property| property.name.as_str()).collect();
        let axes = axes(&names).map_err(|problem| match problem {
            AxisProblem::Missing(name) => Problem::new(format!("element vertex has no property {name}")),
            AxisProblem::Twice(name) => Problem::new(format!("element vertex has property {name} twice")),
        })?;
        for place in axes {
            let property = &element.properties[place];
            if !matches!(property.kind, Kind::Scalar(Type::Known(ScalarType::Float | ScalarType::Double))) {
                return Err(property.problem(format!("it is {}, float or double is needed", property.kind)));
            }
        }
        Ok(Self { element, axes })
    }

    /// The coordinate, 0 to 2, that the property at a place is.
    pub(super) fn axis(&self, place: usize) -> Option<usize> {
        self.axes.iter().position(|axis| *axis == place)
    }
}

/// The elements before `vertex`, whose entries lie before its own.
pub(super) fn before_vertex(header: &Header) -> impl Iterator<Item = &Element> {
    header.elements.iter().take_while(|element| element.name != VERTEX)
}
