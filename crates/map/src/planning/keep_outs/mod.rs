//! Keep-outs beside the voxels: the places where no robot may go count as occupied, as shapes.
//!
//! Everything is in meters of the map frame, in f64: shapes have no level. A ball meets a shape where the shape's
//! distance from its center is at most its radius; a point without a radius where the shape contains it. A map without
//! keep-outs is not asked: the answers of the voxels stand as they are.

mod figure;
mod motions;
mod poses;
mod shapes;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod way_tests;

pub(super) use figure::{Figure, Solid};
pub(super) use motions::{Among, Strides, Way};
pub(super) use poses::Posed;
pub(super) use shapes::Shapes;
