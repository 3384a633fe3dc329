//! Point filters: which points of a scan are used.

use std::fmt::{Display, Formatter, Result as FmtResult};

use crate::geometry::Point;

/// How far the range of a point at a limit may lie from it, relative to it, once its coordinates are rounded to f32.
const ROUNDING: f64 = 1e-6;

/// A filter for the points of a robot's scans: skips those that are too near, too far, or on the robot itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PointFilter {
    /// Distance from the sensor, meters; nearer points are skipped. None: no such limit.
    pub range_min_m: Option<f64>,
    /// Distance from the sensor, meters; farther points are skipped. None: no such limit.
    pub range_max_m: Option<f64>,
    /// Distance from the sensor, meters: from here on a point tells that nothing was met up to here, in a driver's way
    /// of saying "no return" with a direction. It is skipped. None: every point was met.
    pub no_return_m: Option<f64>,
    /// The robot's own body in the sensor frame, meters: smallest and largest corner; points within are skipped.
    pub body_m: Option<([f64; 3], [f64; 3])>,
    /// Points at exactly 0 0 0 count as any other. Otherwise they are skipped: most drivers write them where nothing
    /// returned.
    pub keep_zeros: bool,
    /// Finite points beyond `range_max_m` say nothing. Otherwise they tell that their rays met nothing up to there.
    pub beyond_range_is_noise: bool,
}

/// What it skips, by the names of its fields.
impl Display for PointFilter {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        let numbers = [
            ("range_min_m", self.range_min_m),
            ("range_max_m", self.range_max_m),
            ("no_return_m", self.no_return_m),
        ];
        let mut comma = "";
        for (name, number) in numbers {
            if let Some(number) = number {
                write!(f, "{}{name} {number}", std::mem::replace(&mut comma, ", "))?;
            }
        }
        self.body_m.map_or(Ok(()), |(min, max)| write!(f, "{comma}body_m {min:?} to {max:?}"))
    }
}

/// Why a filter is not valid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PointFilterError {
    /// A range that is negative or not finite; the payload is the field and its value.
    #[error("{0} must be finite and not negative, got {1}")]
    Range(&'static str, f64),
    /// `range_min_m` is not below the other limit, so that nothing would pass; the payload is that, the other's name,
    /// and its value.
    #[error("range_min_m {0} must be below {1} {2}")]
    Empty(f64, &'static str, f64),
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
        let least_m = self.range_min_m.unwrap_or(0.0);
        let upper = [("range_max_m", self.range_max_m), ("no_return_m", self.no_return_m)];
        for (name, range) in [("range_min_m", self.range_min_m)].into_iter().chain(upper) {
            if let Some(range) = range.filter(|range| !(range.is_finite() && *range >= 0.0)) {
                return Err(PointFilterError::Range(name, range));
            }
        }
        for (name, range) in upper {
            if let Some(range) = range.filter(|range| least_m >= *range) {
                return Err(PointFilterError::Empty(least_m, name, range));
            }
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
            no_return_m: self.no_return_m.or(fallback.no_return_m),
            body_m: self.body_m.or(fallback.body_m),
            keep_zeros: self.keep_zeros || fallback.keep_zeros,
            beyond_range_is_noise: self.beyond_range_is_noise || fallback.beyond_range_is_noise,
        }
    }

    /// True of a point (sensor frame) at which a ray ended: it is finite, and not the 0 0 0 of a driver for which
    /// nothing returned.
    pub fn is_return(&self, point: Point) -> bool {
        point.is_finite() && (self.keep_zeros || point.xyz() != [0.0; 3])
    }

    /// True of a finite point (sensor frame) at the distance that means "nothing returned", or farther.
    pub fn is_no_return(&self, point: Point) -> bool {
        // Points at the limit itself were rounded to f32, some of them to nearer than it.
        let range_m = point.to_f64().coords.norm();
        self.no_return_m.is_some_and(|no_return_m| range_m >= no_return_m * (1.0 - ROUNDING))
    }

    /// True when the filter keeps a point (sensor frame).
    pub fn keeps(&self, point: Point) -> bool {
        let range_m = point.to_f64().coords.norm();
        self.is_return(point)
            && self.range_max_m.is_none_or(|max| range_m <= max)
            && !self.is_no_return(point)
            && !self.is_of_robot(point)
    }

    /// True of a finite point (sensor frame) that is skipped since it lies on the robot itself, or too near to be
    /// anything else. It hides what lies behind it.
    pub fn is_of_robot(&self, point: Point) -> bool {
        if !self.is_return(point) {
            return false;
        }
        let point = point.to_f64().coords;
        self.range_min_m.is_some_and(|min| point.norm() < min)
            || self.body_m.is_some_and(|(min, max)| (0..3).all(|i| (min[i]..=max[i]).contains(&point[i])))
    }

    /// Up to where a point (sensor frame) that is skipped as too far tells that nothing was met: to `no_return_m` where
    /// nothing was met at all, and to itself where it is nearer than that. None of a point that is kept, and of one
    /// without a direction; none at all where nobody says from where on nothing was met: see
    /// [`PointFilter::beyond_to`].
    pub fn passed_to(&self, point: Point) -> Option<Point> {
        let no_return_m = self.no_return_m.filter(|_| self.is_return(point))?;
        if self.is_no_return(point) {
            return Some(cut_to(point, no_return_m));
        }
        self.is_beyond(point).then_some(point)
    }

    /// Where nobody says from where on nothing was met, up to where the ray of a point (sensor frame) beyond
    /// `range_max_m` met nothing: to `range_max_m`, since a driver may write any distance for "nothing returned". None
    /// of all other points.
    pub fn beyond_to(&self, point: Point) -> Option<Point> {
        let max_m = self.range_max_m.filter(|_| self.no_return_m.is_none() && self.is_return(point))?;
        self.is_beyond(point).then(|| cut_to(point, max_m))
    }

    /// True of a point beyond `range_max_m`, where that is no noise.
    fn is_beyond(&self, point: Point) -> bool {
        let range_m = point.to_f64().coords.norm();
        !self.beyond_range_is_noise && self.range_max_m.is_some_and(|max_m| range_m > max_m)
    }
}

/// The point of the ray to `point` that is so far from the sensor.
fn cut_to(point: Point, range_m: f64) -> Point {
    let point = point.to_f64().coords;
    let to: [f64; 3] = (point * (range_m / point.norm())).into();
    Point::from(to.map(|c| c as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_is_said_by_its_fields() {
        let filter =
            PointFilter { range_min_m: Some(0.5), no_return_m: Some(30.0), ..PointFilter::default() };
        assert_eq!(filter.to_string(), "range_min_m 0.5, no_return_m 30");
        let body_m = Some(([-1.0; 3], [1.0; 3]));
        let filter = PointFilter { body_m, ..PointFilter::default() };
        assert_eq!(filter.to_string(), "body_m [-1.0, -1.0, -1.0] to [1.0, 1.0, 1.0]");
    }

    #[test]
    fn points_too_near_too_far_or_of_the_robot_are_skipped() {
        let filter = PointFilter {
            range_min_m: Some(0.5),
            range_max_m: Some(10.0),
            no_return_m: None,
            body_m: Some(([-1.0, -0.4, -0.8], [0.2, 0.4, 0.0])),
            ..PointFilter::default()
        };
        let keeps = |x, y, z| filter.keeps(Point::new(x, y, z));
        assert!(keeps(1.0, 0.0, 0.0) && keeps(0.0, 10.0, 0.0));
        assert!(!keeps(0.1, 0.2, 0.3) && !keeps(0.0, 10.1, 0.0) && !keeps(-0.9, 0.3, -0.1));
        let is_of_robot = |x, y, z| filter.is_of_robot(Point::new(x, y, z));
        assert!(is_of_robot(0.1, 0.2, 0.3) && is_of_robot(-0.9, 0.3, -0.1));
        assert!(!is_of_robot(0.0, 10.1, 0.0) && !is_of_robot(1.0, 0.0, 0.0));
    }

    #[test]
    fn zeros_are_no_returns_without_a_direction_unless_they_are_kept() {
        let zero = Point::new(0.0, -0.0, 0.0);
        let filter =
            PointFilter { range_min_m: Some(0.5), no_return_m: Some(30.0), ..PointFilter::default() };
        assert!(!filter.keeps(zero) && !filter.is_of_robot(zero) && filter.passed_to(zero).is_none());
        assert!(!PointFilter::default().keeps(zero));
        let kept = PointFilter { keep_zeros: true, ..PointFilter::default() };
        assert!(kept.keeps(zero) && PointFilter::default().or(kept).keeps(zero));
        assert!(PointFilter { keep_zeros: true, ..filter }.is_of_robot(zero));
    }

    #[test]
    fn from_the_distance_of_no_return_on_points_tell_a_direction_alone() {
        let filter = PointFilter { no_return_m: Some(30.0), ..PointFilter::default() };
        for turn in 0..1000 {
            let (sin, cos) = (f64::from(turn) * 0.01).sin_cos();
            let at_limit = Point::new((30.0 * cos) as f32, (30.0 * sin) as f32, 0.0);
            assert!(!filter.keeps(at_limit) && filter.passed_to(at_limit).is_some(), "{at_limit:?}");
        }
        let (met, far) = (Point::new(0.0, 29.9, 0.0), Point::new(0.0, -60.0, 80.0));
        assert!(filter.keeps(met) && filter.passed_to(met).is_none());
        assert!(!filter.keeps(far));
        assert_eq!(filter.passed_to(far), Some(Point::new(0.0, -18.0, 24.0)));
        assert_eq!(filter.passed_to(Point::new(f32::INFINITY, 0.0, 0.0)), None);
        let near = PointFilter { range_max_m: Some(20.0), ..filter };
        assert!(!near.keeps(met) && near.passed_to(met) == Some(met), "it was met, and makes no voxel");
        assert_eq!((near.beyond_to(met), near.beyond_to(far)), (None, None));
        assert_eq!(near.passed_to(Point::new(0.0, 19.0, 0.0)), None);
        let noise = PointFilter { beyond_range_is_noise: true, ..near };
        assert_eq!((noise.passed_to(met), noise.passed_to(far)), (None, near.passed_to(far)));
        assert_eq!(near.passed_to(far), filter.passed_to(far));
        let none = PointFilter::default();
        assert_eq!((none.passed_to(far), none.beyond_to(far)), (None, None));
    }

    #[test]
    fn a_finite_point_beyond_the_range_proves_its_ray_up_to_there_unless_it_is_noise() {
        let filter = PointFilter { range_max_m: Some(20.0), ..PointFilter::default() };
        assert_eq!(filter.beyond_to(Point::new(0.0, 0.0, 29.9)), Some(Point::new(0.0, 0.0, 20.0)));
        assert_eq!(filter.beyond_to(Point::new(0.0, -6e37, 8e37)), Some(Point::new(0.0, -12.0, 16.0)));
        for nothing in [[0.0, 20.0, 0.0], [0.0; 3], [f32::INFINITY, 0.0, 0.0], [f32::NAN, 30.0, 0.0]] {
            assert_eq!(filter.beyond_to(nothing.into()), None, "{nothing:?}");
        }
        let noise = PointFilter { beyond_range_is_noise: true, ..filter };
        assert_eq!(noise.beyond_to(Point::new(0.0, 0.0, 29.9)), None);
        assert_eq!(filter.or(PointFilter { range_max_m: None, ..noise }), noise, "a robot's setting holds");
    }

    #[test]
    fn numbers_that_make_no_filter_are_named() {
        let message = |filter: PointFilter| filter.checked().unwrap_err().to_string();
        let range = |min, max| PointFilter {
            range_min_m: Some(min),
            range_max_m: Some(max),
            ..PointFilter::default()
        };
        assert!(message(range(-1.0, 2.0)).contains("range_min_m"));
        assert!(message(range(1.0, f64::NAN)).contains("range_max_m"));
        assert_eq!(message(range(2.0, 2.0)), "range_min_m 2 must be below range_max_m 2");
        let nothing = PointFilter { no_return_m: Some(0.0), ..PointFilter::default() };
        assert_eq!(message(nothing), "range_min_m 0 must be below no_return_m 0");
        let body = PointFilter { body_m: Some(([0.0; 3], [1.0, -1.0, 1.0])), ..PointFilter::default() };
        assert!(message(body).contains("body_m"));
        assert!(range(0.5, 10.0).checked().is_ok());
    }
}
