//! Boxes that stand at an angle.

use super::error::{REGION_M_MAX, RegionError};
use crate::geometry::{Pose, translation_m};

/// A box with any orientation, border included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedBox {
    map_from_box: Pose,
    size_m: [f64; 3],
}

impl OrientedBox {
    /// The box of sides `size_m` along the axes of its own frame, centered at that frame's origin, which
    /// `map_from_box` places in the map.
    ///
    /// # Errors
    /// When a number is not finite or beyond [`REGION_M_MAX`], or a side is negative.
    pub fn new(map_from_box: Pose, size_m: [f64; 3]) -> Result<Self, RegionError> {
        let center_m = translation_m(&map_from_box);
        let within = |number: f64| number.abs() <= REGION_M_MAX;
        if size_m.iter().any(|side| side.is_nan() || *side < 0.0) {
            return Err(RegionError::OrientedBox(size_m));
        }
        if center_m.into_iter().chain(size_m).all(within) {
            Ok(Self { map_from_box, size_m })
        } else {
            Err(RegionError::OrientedBoxTooFar(center_m, size_m))
        }
    }

    /// Where its center is, and how it is turned.
    pub fn map_from_box(&self) -> &Pose {
        &self.map_from_box
    }

    /// Its sides along its own axes, meters.
    pub fn size_m(&self) -> [f64; 3] {
        self.size_m
    }

    /// True when the point, meters in the map frame, lies inside or on the border.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        let in_box = self.map_from_box.inverse_transform_point(&point_m.into());
        (0..3).all(|axis| in_box[axis].abs() <= self.size_m[axis] / 2.0)
    }

    /// The smallest box along the map's axes around it: (smallest, largest) coordinates, meters.
    pub(super) fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        let rotation = self.map_from_box.rotation.to_rotation_matrix();
        let extent_m =
            |axis: usize| (0..3).map(|of| rotation[(axis, of)].abs() * self.size_m[of] / 2.0).sum::<f64>();
        let center_m = translation_m(&self.map_from_box);
        // A border that is rounded inwards would cut off what lies on it.
        let rounding_m = |axis: usize| 1e-12 * (center_m[axis].abs() + extent_m(axis));
        let half_m = |axis: usize| extent_m(axis) + rounding_m(axis);
        (
            std::array::from_fn(|axis| center_m[axis] - half_m(axis)),
            std::array::from_fn(|axis| center_m[axis] + half_m(axis)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn at(center_m: [f64; 3], turned: [f64; 3]) -> Pose {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(turned));
        Pose::from_parts(Translation3::from(Vector3::from(center_m)), rotation)
    }

    #[test]
    fn a_box_at_45_degrees_holds_its_corners_and_not_those_of_its_bounds() {
        let of = OrientedBox::new(at([1.0, 0.0, 0.0], [0.0, 0.0, std::f64::consts::FRAC_PI_4]), [2.0; 3]);
        let of = of.unwrap();
        assert!(of.contains([1.0 + 2f64.sqrt() - 1e-9, 0.0, 1.0]) && of.contains([1.0; 3]));
        assert!(!of.contains([2.2, 1.2, 0.0]) && !of.contains([1.0, 0.0, 1.001]));
        let (min_m, max_m) = of.bounds_m();
        assert!((min_m[0] - (1.0 - 2f64.sqrt())).abs() < 1e-9 && (max_m[1] - 2f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn numbers_that_bound_nothing_are_refused() {
        let of = |center_m, size_m| OrientedBox::new(at(center_m, [0.0; 3]), size_m);
        assert!(of([0.0; 3], [0.0; 3]).is_ok());
        for size_m in [[-1.0, 1.0, 1.0], [f64::NAN, 1.0, 1.0], [1.0, f64::INFINITY, 1.0]] {
            assert!(of([0.0; 3], size_m).is_err(), "{size_m:?}");
        }
        assert!(of([0.0, 2e12, 0.0], [1.0; 3]).unwrap_err().to_string().contains("within 1e12 m"));
    }

    proptest! {
        #[test]
        fn what_lies_inside_lies_within_the_bounds(
            center in prop::array::uniform3(-1e6..1e6f64),
            turned in prop::array::uniform3(-3.0..3.0f64),
            size in prop::array::uniform3(0.0..50.0f64),
            share in prop::array::uniform3(-0.5..=0.5f64),
        ) {
            let of = OrientedBox::new(at(center, turned), size).unwrap();
            let inside = nalgebra::Point3::from(std::array::from_fn(|axis| share[axis] * size[axis]));
            let point = of.map_from_box() * inside;
            let (min_m, max_m) = of.bounds_m();
            prop_assert!((0..3).all(|axis| (min_m[axis]..=max_m[axis]).contains(&point[axis])));
        }
    }
}
