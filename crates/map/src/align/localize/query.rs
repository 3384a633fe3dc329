//! Queries of global localization: what is known beforehand of where a scan was taken.

use crate::align::gravity::{Gravity, GravityError};

/// What to search for, and where.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LocalizationQuery {
    /// Direction of gravity; without it, any rotation is considered.
    pub gravity: Option<Gravity>,
    /// Box in which the sensor may be; without it, the bulk of the map and around its trajectory.
    pub search_box: Option<SearchBox>,
    /// Most candidates that are returned.
    pub candidates: usize,
    /// Seed of the choice of the scan's points: the same seed gives the same answer, on every machine.
    pub seed: u64,
}

/// A box in the map frame, meters; its sides may be infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchBox {
    pub(super) min_m: [f64; 3],
    pub(super) max_m: [f64; 3],
}

/// Why a query is not valid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LocalizationQueryError {
    /// A direction that is none.
    #[error(transparent)]
    Gravity(#[from] GravityError),
    /// A corner with NaN, or corners in the wrong order.
    #[error("search_box.min_m must not exceed search_box.max_m in any axis, got {0:?} and {1:?}")]
    Box([f64; 3], [f64; 3]),
}

impl SearchBox {
    /// The box from `min_m` to `max_m`.
    ///
    /// # Errors
    /// When a coordinate is NaN or a smallest one exceeds its largest.
    pub fn new(min_m: [f64; 3], max_m: [f64; 3]) -> Result<Self, LocalizationQueryError> {
        let ordered = (0..3).all(|axis| min_m[axis] <= max_m[axis]);
        if ordered { Ok(Self { min_m, max_m }) } else { Err(LocalizationQueryError::Box(min_m, max_m)) }
    }

    /// Smallest coordinates, meters.
    pub fn min_m(&self) -> [f64; 3] {
        self.min_m
    }

    /// Largest coordinates, meters.
    pub fn max_m(&self) -> [f64; 3] {
        self.max_m
    }

    /// True where a point of the map lies in the box, borders included.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        (0..3).all(|axis| (self.min_m[axis]..=self.max_m[axis]).contains(&point_m[axis]))
    }

    /// The box of the voxels `low` to `high`.
    pub(super) fn of_voxels(low: [i32; 3], high: [i32; 3], resolution_m: f64) -> Self {
        let side = |i: i32| f64::from(i) * resolution_m;
        Self { min_m: low.map(side), max_m: high.map(|i| side(i + 1)) }
    }

    /// The box with `by_m` more on each side.
    pub(super) fn grown(self, by_m: f64) -> Self {
        Self { min_m: self.min_m.map(|c| c - by_m), max_m: self.max_m.map(|c| c + by_m) }
    }

    /// The smallest box that holds this one and a point.
    pub(super) fn holding(self, point_m: [f64; 3]) -> Self {
        Self {
            min_m: std::array::from_fn(|axis| self.min_m[axis].min(point_m[axis])),
            max_m: std::array::from_fn(|axis| self.max_m[axis].max(point_m[axis])),
        }
    }

    /// The intersection of both boxes; none where it is empty.
    pub(super) fn meet(self, other: Self) -> Option<Self> {
        let min_m = std::array::from_fn(|axis| self.min_m[axis].max(other.min_m[axis]));
        let max_m = std::array::from_fn(|axis| self.max_m[axis].min(other.max_m[axis]));
        Self::new(min_m, max_m).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_needs_corners_in_order_and_may_be_endless() {
        assert!(SearchBox::new([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).is_ok());
        for bad in [[-1.0, 1.0, 1.0], [f64::NAN, 1.0, 1.0]] {
            let error = SearchBox::new([0.0; 3], bad).unwrap_err().to_string();
            assert!(error.contains("search_box.min_m"), "{error}");
        }
    }

    #[test]
    fn boxes_meet_where_both_are() {
        let cube = |low: f64, high: f64| SearchBox::new([low; 3], [high; 3]).unwrap();
        assert_eq!(cube(0.0, 2.0).meet(cube(1.0, 3.0)), Some(cube(1.0, 2.0)));
        assert_eq!(cube(0.0, 1.0).meet(cube(2.0, 3.0)), None);
        assert_eq!(cube(0.0, 1.0).grown(1.0).holding([5.0; 3]), cube(-1.0, 5.0));
    }
}
