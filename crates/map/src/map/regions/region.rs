//! Boxes, spheres and oriented boxes.

use super::error::{REGION_M_MAX, RegionError};
use super::oriented_box::OrientedBox;
use crate::geometry::Pose;

/// A part of space in the map frame; borders belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// An axis-aligned box, meters.
    Box {
        /// Smallest coordinates.
        min_m: [f64; 3],
        /// Largest coordinates.
        max_m: [f64; 3],
    },
    /// A ball, meters.
    Sphere {
        /// The center, meters, map frame.
        center_m: [f64; 3],
        /// The radius, meters.
        radius_m: f64,
    },
    /// A box with any orientation.
    OrientedBox(OrientedBox),
}

impl Region {
    /// The box from `min_m` to `max_m`; infinite sides are fine.
    ///
    /// # Errors
    /// When a coordinate is NaN or a smallest one exceeds its largest.
    pub fn cuboid(min_m: [f64; 3], max_m: [f64; 3]) -> Result<Self, RegionError> {
        let ordered = (0..3).all(|axis| min_m[axis] <= max_m[axis]);
        if ordered { Ok(Self::Box { min_m, max_m }) } else { Err(RegionError::Box(min_m, max_m)) }
    }

    /// The ball about `center_m`.
    ///
    /// # Errors
    /// When a number is not finite or beyond [`REGION_M_MAX`], or the radius negative.
    pub fn ball(center_m: [f64; 3], radius_m: f64) -> Result<Self, RegionError> {
        let finite = center_m.iter().all(|c| c.is_finite()) && radius_m.is_finite();
        let within = center_m.iter().all(|c| c.abs() <= REGION_M_MAX) && radius_m <= REGION_M_MAX;
        match (finite && radius_m >= 0.0, within) {
            (true, true) => Ok(Self::Sphere { center_m, radius_m }),
            (true, false) => Err(RegionError::SphereTooFar(center_m, radius_m)),
            (false, _) => Err(RegionError::Sphere(center_m, radius_m)),
        }
    }

    /// True when the point lies inside or on the border.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        match self {
            Self::Box { min_m, max_m } => {
                (0..3).all(|axis| (min_m[axis]..=max_m[axis]).contains(&point_m[axis]))
            }
            Self::Sphere { center_m, radius_m } => {
                let from_center = |axis: usize| point_m[axis] - center_m[axis];
                let squared: f64 = (0..3).map(|axis| from_center(axis).powi(2)).sum();
                if (squared + radius_m * radius_m).is_finite() {
                    return squared <= radius_m * radius_m;
                }
                // Too far for squares, which only a sphere that nobody checked can be: shares of the radius.
                (0..3).map(|axis| (from_center(axis) / radius_m).powi(2)).sum::<f64>() <= 1.0
            }
            Self::OrientedBox(of) => of.contains(point_m),
        }
    }

    /// The box of sides `size_m` about the origin of a frame that `map_from_box` places in the map.
    ///
    /// # Errors
    /// As [`OrientedBox::new`].
    pub fn oriented_box(map_from_box: Pose, size_m: [f64; 3]) -> Result<Self, RegionError> {
        OrientedBox::new(map_from_box, size_m).map(Self::OrientedBox)
    }

    /// The smallest box along the map's axes around it: (smallest, largest) coordinates.
    pub(in crate::map) fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        match *self {
            Self::Box { min_m, max_m } => (min_m, max_m),
            Self::Sphere { center_m, radius_m } => {
                (center_m.map(|c| c - radius_m), center_m.map(|c| c + radius_m))
            }
            Self::OrientedBox(ref of) => of.bounds_m(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_belong_to_a_region() {
        let cube = Region::cuboid([0.0; 3], [1.0; 3]).unwrap();
        assert!(cube.contains([0.0, 1.0, 0.5]) && !cube.contains([0.0, 1.001, 0.5]));
        let ball = Region::ball([1.0, 0.0, 0.0], 1.0).unwrap();
        assert!(ball.contains([0.0; 3]) && !ball.contains([-0.001, 0.0, 0.0]));
    }

    #[test]
    fn numbers_that_bound_nothing_are_refused() {
        assert!(Region::cuboid([0.0, 2.0, 0.0], [1.0; 3]).is_err());
        assert!(Region::cuboid([f64::NAN, 0.0, 0.0], [1.0; 3]).is_err());
        assert!(Region::cuboid([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).is_ok());
        assert!(Region::ball([0.0; 3], -1.0).is_err());
        assert!(Region::ball([0.0; 3], f64::INFINITY).is_err());
        assert!(Region::ball([f64::NAN, 0.0, 0.0], 1.0).is_err());
    }

    #[test]
    fn a_ball_as_far_as_no_map_goes_is_refused_and_holds_nothing_here() {
        for (center_m, radius_m) in
            [([1e200, 0.0, 0.0], 1e199), ([0.0, -2e12, 0.0], 1.0), ([0.0; 3], 1.1e12), ([f64::MAX; 3], 0.0)]
        {
            let error = Region::ball(center_m, radius_m).unwrap_err();
            assert!(error.to_string().contains("within 1e12 m"), "{error}");
        }
        assert!(Region::ball([1e12, 0.0, -1e12], 1e12).is_ok());
        let holds = |center_m, radius_m| Region::Sphere { center_m, radius_m }.contains([0.0; 3]);
        assert!(!holds([1e200, 0.0, 0.0], 1e199) && !holds([1e200; 3], 0.0) && !holds([f64::MAX; 3], 1e308));
        assert!(holds([1e200, 0.0, 0.0], 1e200) && holds([1e200, 1e200, 0.0], 2e200));
    }

    #[test]
    fn a_box_of_any_numbers_holds_what_lies_between_them() {
        for far in [1e200, f64::MAX, f64::INFINITY] {
            let cuboid = |min_m, max_m| Region::cuboid(min_m, max_m).unwrap();
            assert!(cuboid([-far; 3], [far; 3]).contains([0.0; 3]));
            assert!(!cuboid([1.0; 3], [far; 3]).contains([0.0; 3]));
            assert!(!cuboid([-far; 3], [-1.0; 3]).contains([0.0; 3]));
            assert!(Region::cuboid([far; 3], [-far; 3]).is_err());
        }
    }
}
