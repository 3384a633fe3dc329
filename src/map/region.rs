//! Parts of space that a caller names.

/// A part of space in the map frame; borders belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// An axis-aligned box, metres.
    Box {
        /// Smallest coordinates.
        min_m: [f64; 3],
        /// Largest coordinates.
        max_m: [f64; 3],
    },
    /// A ball, metres.
    Sphere {
        /// Its centre.
        center_m: [f64; 3],
        /// Its radius.
        radius_m: f64,
    },
}

/// Why numbers are not a region.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// A corner with NaN, or corners in the wrong order.
    #[error("box.min_m must not exceed box.max_m in any axis, got {0:?} and {1:?}")]
    Box([f64; 3], [f64; 3]),
    /// A centre or radius that is not finite, or a negative radius.
    #[error("sphere.center_m must be finite and sphere.radius_m not negative, got {0:?} and {1}")]
    Sphere([f64; 3], f64),
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
    /// When a number is not finite or the radius negative.
    pub fn ball(center_m: [f64; 3], radius_m: f64) -> Result<Self, RegionError> {
        let finite = center_m.iter().all(|c| c.is_finite()) && radius_m.is_finite();
        if finite && radius_m >= 0.0 {
            Ok(Self::Sphere { center_m, radius_m })
        } else {
            Err(RegionError::Sphere(center_m, radius_m))
        }
    }

    /// True when the point lies inside or on the border.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        match self {
            Self::Box { min_m, max_m } => {
                (0..3).all(|axis| (min_m[axis]..=max_m[axis]).contains(&point_m[axis]))
            }
            Self::Sphere { center_m, radius_m } => {
                let squared: f64 = (0..3).map(|axis| (point_m[axis] - center_m[axis]).powi(2)).sum();
                squared <= radius_m * radius_m
            }
        }
    }

    /// The smallest box around it: (smallest, largest) coordinates.
    pub(super) fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        match *self {
            Self::Box { min_m, max_m } => (min_m, max_m),
            Self::Sphere { center_m, radius_m } => {
                (center_m.map(|c| c - radius_m), center_m.map(|c| c + radius_m))
            }
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
    }
}
