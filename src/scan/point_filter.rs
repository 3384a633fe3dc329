//! Point filters: which points of a scan are used.

use crate::geometry::Point;

/// A filter for the points of a robot's scans: skips those that are too near, too far, or on the robot itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PointFilter {
    /// Distance from the sensor, meters; nearer points are skipped. None: no such limit.
    pub range_min_m: Option<f64>,
    /// Distance from the sensor, meters; farther points are skipped. None: no such limit.
    pub range_max_m: Option<f64>,
    /// The robot's own body in the sensor frame, meters: smallest and largest corner; points within are skipped.
    pub body_m: Option<([f64; 3], [f64; 3])>,
}

/// Why a filter is not valid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PointFilterError {
    /// A range that is negative or not finite; the payload is the field and its value.
    #[error("{0} must be finite and not negative, got {1}")]
    Range(&'static str, f64),
    /// `range_min_m` is not below `range_max_m`, so that nothing would pass.
    #[error("range_min_m {0} must be below range_max_m {1}")]
    Empty(f64, f64),
    /// A box whose corners are not finite or not in order.
    #[error("body_m must have finite corners, the smaller first, got {0:?} and {1:?}")]
    Body([f64; 3], [f64; 3]),
}

impl PointFilter {
    /// Checks the filter's numbers, and returns the filter.
    ///
    /// # Errors
    /// Names what is out of range.
    pub fn checked(self) -> Result<Self, PointFilterError> {
        for (name, range) in [("range_min_m", self.range_min_m), ("range_max_m", self.range_max_m)] {
            if let Some(range) = range.filter(|range| !(range.is_finite() && *range >= 0.0)) {
                return Err(PointFilterError::Range(name, range));
            }
        }
        if let (Some(min), Some(max)) = (self.range_min_m, self.range_max_m)
            && min >= max
        {
            return Err(PointFilterError::Empty(min, max));
        }
        match self.body_m {
            Some((min, max))
                if !(0..3).all(|i| min[i] <= max[i] && min[i].is_finite() && max[i].is_finite()) =>
            {
                Err(PointFilterError::Body(min, max))
            }
            _ => Ok(self),
        }
    }

    /// This filter, with the values of `fallback` for what it leaves open.
    pub fn or(self, fallback: Self) -> Self {
        Self {
            range_min_m: self.range_min_m.or(fallback.range_min_m),
            range_max_m: self.range_max_m.or(fallback.range_max_m),
            body_m: self.body_m.or(fallback.body_m),
        }
    }

    /// True when the filter keeps a finite point (sensor frame).
    pub fn keeps(&self, point: Point) -> bool {
        let point = point.to_f64().coords;
        let range_m = point.norm();
        let in_body =
            self.body_m.is_some_and(|(min, max)| (0..3).all(|i| (min[i]..=max[i]).contains(&point[i])));
        self.range_min_m.is_none_or(|min| range_m >= min)
            && self.range_max_m.is_none_or(|max| range_m <= max)
            && !in_body
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_too_near_too_far_or_of_the_robot_are_skipped() {
        let filter = PointFilter {
            range_min_m: Some(0.5),
            range_max_m: Some(10.0),
            body_m: Some(([-1.0, -0.4, -0.8], [0.2, 0.4, 0.0])),
        };
        let keeps = |x, y, z| filter.keeps(Point::new(x, y, z));
        assert!(keeps(1.0, 0.0, 0.0) && keeps(0.0, 10.0, 0.0));
        assert!(!keeps(0.1, 0.2, 0.3) && !keeps(0.0, 10.1, 0.0) && !keeps(-0.9, 0.3, -0.1));
        assert!(PointFilter::default().keeps(Point::new(0.0, 0.0, 0.0)));
    }

    #[test]
    fn numbers_that_make_no_filter_are_named() {
        let message = |filter: PointFilter| filter.checked().unwrap_err().to_string();
        let range = |min, max| PointFilter { range_min_m: Some(min), range_max_m: Some(max), body_m: None };
        assert!(message(range(-1.0, 2.0)).contains("range_min_m"));
        assert!(message(range(1.0, f64::NAN)).contains("range_max_m"));
        assert!(message(range(2.0, 2.0)).contains("must be below"));
        let body = PointFilter { body_m: Some(([0.0; 3], [1.0, -1.0, 1.0])), ..PointFilter::default() };
        assert!(message(body).contains("body_m"));
        assert!(range(0.5, 10.0).checked().is_ok());
    }
}
