//! Points of either precision, as a file gives them.

use nalgebra::Point3;

use crate::geometry::Point;

/// What the readers make of three coordinates: a [`Point`], or one in double precision for files in survey coordinates.
pub(super) trait Coordinates: Sized {
    /// The point of single coordinates, meters.
    fn of_singles(xyz: [f32; 3]) -> Self;
    /// The point of double coordinates, meters.
    fn of_doubles(xyz: [f64; 3]) -> Self;
}

impl Coordinates for Point {
    fn of_singles(xyz: [f32; 3]) -> Self {
        xyz.into()
    }

    fn of_doubles(xyz: [f64; 3]) -> Self {
        xyz.map(|c| c as f32).into()
    }
}

impl Coordinates for Point3<f64> {
    fn of_singles(xyz: [f32; 3]) -> Self {
        xyz.map(f64::from).into()
    }

    fn of_doubles(xyz: [f64; 3]) -> Self {
        xyz.into()
    }
}
