//! Points that do not seem to be in meters.

use std::fmt::{self, Display};

use nalgebra::Point3;

use super::point_filter::PointFilter;
use crate::geometry::Point;

/// Median range from which points are thought not to be in meters: sensors of robots reach some 500 m at most, and half
/// of a scan lies far nearer. A room in millimeters has thousands.
const MEDIAN_RANGE_MAX: f64 = 500.0;

/// Least ratio of the span of a scan to its median range. For a sensor that sees all sides it is 1 or more, for one of
/// a narrow field of view some 0.3. Points of a survey lie close together and far from 0: below 0.01.
const SPAN_RATIO_MIN: f64 = 0.1;

/// Share of the points at each end of an axis that do not count for the span: drivers write huge values where nothing
/// returned.
const ENDS: f64 = 0.01;

/// Points that are looked at, evenly over their order: so many tell the unit of any scan.
const LOOKED_AT_MAX: usize = 4096;

/// Points of a scan that are most likely in millimeters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitDoubt {
    /// Median range of the points, as if they were in meters.
    pub median_range_m: f64,
    /// The largest span of the points along an axis, but for the hundredth at either end.
    pub span_m: f64,
}

impl UnitDoubt {
    /// The doubt about points in the sensor frame; none where they may well be in meters.
    ///
    /// It selects among the ranges of a few thousand points, which is meant for scans that were refused and for the
    /// first one of a map.
    pub fn of(points: impl ExactSizeIterator<Item = Point3<f64>>) -> Option<Self> {
        let (filter, step) = (PointFilter::default(), points.len().div_ceil(LOOKED_AT_MAX).max(1));
        let returns: Vec<_> =
            points.step_by(step).filter(|point| filter.is_return(Point::from(*point))).collect();
        let median_range_m = quantile(returns.iter().map(|point| point.coords.norm()).collect(), 0.5)?;
        if median_range_m <= MEDIAN_RANGE_MAX {
            return None;
        }
        let span_of = |axis: usize| {
            let along = || returns.iter().map(|point| point.coords[axis]).collect::<Vec<f64>>();
            Some(quantile(along(), 1.0 - ENDS)? - quantile(along(), ENDS)?)
        };
        let span_m = (0..3).filter_map(span_of).fold(0.0, f64::max);
        (span_m >= SPAN_RATIO_MIN * median_range_m).then_some(Self { median_range_m, span_m })
    }
}

/// In words: `the median range of its points is 2749 m, and they span 5990 m: are they in millimeters? ...`.
impl Display for UnitDoubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the median range of its points is {:.0} m, and they span {:.0} m: are they in millimeters? Points are read as \
             meters; divide millimeters by 1000 first",
            self.median_range_m, self.span_m
        )
    }
}

/// The value below which a `share` of the `values` lie; none without values.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let (_, value, _) = values.select_nth_unstable_by((last as f64 * share) as usize, f64::total_cmp);
    Some(*value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on the walls of a box of these half sides around the sensor.
    fn room(half: f64, count: i32) -> Vec<Point3<f64>> {
        let on_wall = |k: i32| {
            let angle = 0.1 * f64::from(k);
            Point3::new(half * angle.cos(), half * angle.sin(), 0.3 * half * (angle * 0.37).sin())
        };
        (0..count).map(on_wall).collect()
    }

    fn doubt(points: &[Point3<f64>]) -> Option<UnitDoubt> {
        UnitDoubt::of(points.iter().copied())
    }

    #[test]
    fn a_room_in_millimeters_is_told_with_its_median_range_and_span() {
        let mut millimeters = room(3000.0, 200);
        millimeters.extend([Point3::new(1e30, 0.0, 0.0), Point3::origin(), Point3::new(f64::NAN, 0.0, 0.0)]);
        let said = doubt(&millimeters).unwrap().to_string();
        assert!(said.starts_with("the median range") && said.contains("span 5997 m"), "{said}");
        // Of many points some are looked at.
        let large = doubt(&room(3000.0, 90_000)).unwrap();
        assert!((large.span_m - 6000.0).abs() < 30.0, "{large}");
    }

    #[test]
    fn far_scans_surveys_and_nothing_are_not_doubted() {
        assert_eq!(doubt(&room(3.0, 200)), None);
        assert_eq!(doubt(&room(400.0, 200)), None);
        assert_eq!(doubt(&[]), None);
        let survey: Vec<_> =
            room(80.0, 200).iter().map(|p| p + nalgebra::Vector3::new(388e3, 3948e3, 12.0)).collect();
        assert_eq!(doubt(&survey), None);
    }
}
