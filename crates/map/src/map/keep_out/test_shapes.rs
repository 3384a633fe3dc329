//! Shapes of all kinds within 30 m, for property tests.

use proptest::prelude::*;

use super::prism::Prism;
use super::shape::KeepOutShape;
use crate::geometry::Pose;
use crate::map::regions::Region;

/// A box, a ball, an oriented box or a prism.
pub(crate) fn shape() -> impl Strategy<Value = KeepOutShape> {
    let place = || prop::array::uniform3(-20.0..20.0f64);
    let size = || prop::array::uniform3(0.0..15.0f64);
    let region = |region| KeepOutShape::of_region(region).unwrap();
    prop_oneof![
        (place(), size()).prop_map(move |(min, size)| {
            let max = std::array::from_fn(|axis| min[axis] + size[axis]);
            region(Region::cuboid(min, max).unwrap())
        }),
        (place(), 0.0..9.0f64)
            .prop_map(move |(center, radius)| region(Region::ball(center, radius).unwrap())),
        (place(), place(), size()).prop_map(move |(center, turned, size)| {
            let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turned.into());
            let moved = nalgebra::Translation3::from(nalgebra::Vector3::from(center));
            region(Region::oriented_box(Pose::from_parts(moved, rotation), size).unwrap())
        }),
        (place(), prop::collection::vec(1.0..9.0f64, 3..12), 0.1..9.0f64).prop_map(
            |([x, y, z], radii, height)| {
                let corner = |(i, radius): (usize, &f64)| {
                    let (sin, cos) = (i as f64 * std::f64::consts::TAU / radii.len() as f64).sin_cos();
                    [x + cos * radius, y + sin * radius]
                };
                let corners: Vec<_> = radii.iter().enumerate().map(corner).collect();
                KeepOutShape::Prism(Prism::new(&corners, [z, z + height]).unwrap())
            }
        ),
    ]
}
