//! A polygon with a height: the shape of a room, or of a place that is taped off.

use std::sync::Arc;

use super::polygon;
use crate::map::regions::REGION_M_MAX;

/// Corners that the polygon of a prism may have.
pub const PRISM_CORNERS_MAX: usize = 64;

/// All points above or below a simple polygon, between two heights; borders belong to it. Map frame, meters.
#[derive(Debug, Clone, PartialEq)]
pub struct Prism {
    corners_m: Arc<[[f64; 2]]>,
    z_m: [f64; 2],
}

/// Why numbers are not a prism.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PrismError {
    /// Too few corners, or more than [`PRISM_CORNERS_MAX`].
    #[error("prism.corners_m must be 3 to {PRISM_CORNERS_MAX} corners, got {0}")]
    Corners(usize),
    /// A corner that is not finite, or too far away.
    #[error("prism.corners_m[{0}] must be finite and within {REGION_M_MAX:e} m, got {1:?}")]
    Corner(usize, [f64; 2]),
    /// Two corners at one place.
    #[error(
        "prism.corners_m[{0}] and prism.corners_m[{1}] are the same: name each corner once, the first one too"
    )]
    Repeated(usize, usize),
    /// All corners on one line.
    #[error("prism.corners_m must enclose an area: all of its corners lie on one line")]
    NoArea,
    /// Two sides that cross or touch.
    #[error(
        "prism.corners_m must go round the polygon: the side from corner {0} crosses or touches that from corner {1}"
    )]
    Crossing(usize, usize),
    /// Heights that are not finite, too far away, or not in order.
    #[error("prism.z_from_m must be less than prism.z_to_m, both within {REGION_M_MAX:e} m, got {0} and {1}")]
    Heights(f64, f64),
}

impl Prism {
    /// The prism of the polygon with `corners_m` (x and y of each, in either direction round it) from the height
    /// `z_m[0]` to `z_m[1]`.
    ///
    /// # Errors
    /// When there are fewer than 3 corners or more than [`PRISM_CORNERS_MAX`], a number is not finite or beyond
    /// [`REGION_M_MAX`], a corner comes twice, the polygon has no area or crosses itself, or the heights do not ascend.
    pub fn new(corners_m: &[[f64; 2]], z_m: [f64; 2]) -> Result<Self, PrismError> {
        if !(3..=PRISM_CORNERS_MAX).contains(&corners_m.len()) {
            return Err(PrismError::Corners(corners_m.len()));
        }
        let is_far = |corner: &[f64; 2]| !corner.iter().copied().all(is_near);
        if let Some(i) = corners_m.iter().position(is_far) {
            return Err(PrismError::Corner(i, corners_m[i]));
        }
        let [from, to] = z_m;
        if !(is_near(from) && is_near(to) && from < to) {
            return Err(PrismError::Heights(from, to));
        }
        if let Some((one, other)) = polygon::repeated_corners(corners_m) {
            return Err(PrismError::Repeated(one, other));
        }
        if polygon::is_flat(corners_m) {
            return Err(PrismError::NoArea);
        }
        match polygon::crossing_sides(corners_m) {
            Some((one, other)) => Err(PrismError::Crossing(one, other)),
            None => Ok(Self { corners_m: corners_m.into(), z_m }),
        }
    }

    /// x and y of each corner, meters.
    pub fn corners_m(&self) -> &[[f64; 2]] {
        &self.corners_m
    }

    /// The smallest and the largest height, meters.
    pub fn z_m(&self) -> [f64; 2] {
        self.z_m
    }

    /// True when the point lies inside or on the border.
    pub fn contains(&self, [x, y, z]: [f64; 3]) -> bool {
        (self.z_m[0]..=self.z_m[1]).contains(&z) && polygon::contains(&self.corners_m, [x, y])
    }

    /// How far the point lies from the prism, meters; 0 inside.
    pub fn distance_m(&self, [x, y, z]: [f64; 3]) -> f64 {
        let [from, to] = self.z_m;
        let vertical = (from - z).max(z - to).max(0.0);
        polygon::distance(&self.corners_m, [x, y]).hypot(vertical)
    }

    /// The smallest box around it: (smallest, largest) coordinates.
    pub(in crate::map) fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        let along = |axis: usize, pick: fn(f64, f64) -> f64| {
            self.corners_m.iter().map(|corner| corner[axis]).reduce(pick).unwrap_or_default()
        };
        let [from, to] = self.z_m;
        ([along(0, f64::min), along(1, f64::min), from], [along(0, f64::max), along(1, f64::max), to])
    }
}

/// True of a coordinate within reach of maps.
pub(super) fn is_near(c: f64) -> bool {
    c.abs() <= REGION_M_MAX
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];

    #[test]
    fn what_is_no_prism_is_refused_by_the_corner_that_is_wrong() {
        let said = |corners: &[[f64; 2]], z_m| Prism::new(corners, z_m).unwrap_err().to_string();
        let with = |i: usize, corner: [f64; 2]| {
            let mut corners = SQUARE;
            corners[i] = corner;
            said(&corners, [0.0, 1.0])
        };
        assert!(said(&SQUARE[..2], [0.0, 1.0]).contains("3 to 64 corners, got 2"));
        assert!(said(&vec![[0.0; 2]; 1_000_000], [0.0, 1.0]).contains("got 1000000"));
        assert!(with(1, [f64::NAN, 0.0]).starts_with("prism.corners_m[1] must be finite"));
        assert!(with(3, [0.0, f64::INFINITY]).starts_with("prism.corners_m[3] must be finite"));
        assert!(with(2, [1.1e12, 0.0]).contains("within 1e12 m"));
        assert!(with(3, [0.0, 0.0]).starts_with("prism.corners_m[0] and prism.corners_m[3] are the same"));
        assert!(
            with(2, [1.0, -1.0]).contains("the side from corner 0 crosses or touches that from corner 2")
        );
        assert!(said(&[[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]], [0.0, 1.0]).contains("on one line"));
        for z_m in [[1.0, 1.0], [1.0, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY], [-1e13, 0.0]] {
            assert!(said(&SQUARE, z_m).starts_with("prism.z_from_m must be less than"), "{z_m:?}");
        }
    }

    #[test]
    fn a_prism_may_have_sixty_four_corners_and_no_more() {
        let circle = |n: usize| {
            let corner = |i: usize| (i as f64 * std::f64::consts::TAU / n as f64).sin_cos();
            (0..n).map(corner).map(|(sin, cos)| [cos, sin]).collect::<Vec<_>>()
        };
        assert!(Prism::new(&circle(64), [0.0, 1.0]).is_ok());
        assert_eq!(Prism::new(&circle(65), [0.0, 1.0]), Err(PrismError::Corners(65)));
    }

    #[test]
    fn borders_belong_to_a_prism_and_distance_is_measured_from_them() {
        let prism = Prism::new(&SQUARE, [1.0, 3.0]).unwrap();
        for inside in [[0.0, 0.0, 1.0], [2.0, 2.0, 3.0], [1.0, 0.0, 2.0], [1.0, 1.0, 1.0]] {
            assert!(prism.contains(inside) && prism.distance_m(inside) == 0.0, "{inside:?}");
        }
        assert!(!prism.contains([1.0, 1.0, 0.9]) && !prism.contains([2.1, 1.0, 2.0]));
        assert_eq!(prism.distance_m([1.0, 1.0, 0.0]), 1.0);
        assert_eq!(prism.distance_m([5.0, 1.0, 7.0]), 5.0);
        assert_eq!(prism.bounds_m(), ([0.0, 0.0, 1.0], [2.0, 2.0, 3.0]));
    }
}
