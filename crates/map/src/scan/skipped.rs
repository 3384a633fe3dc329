//! Skipped points: how many points of a scan do not count, and why.

use std::fmt::{self, Display};

use super::point_filter::PointFilter;
use crate::geometry::Point;

/// The words that say so.
const SKIPPED: &str = " points skipped";

/// How many points of a scan are skipped, by the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SkippedPoints {
    /// All points of the scan, skipped or not.
    pub points: usize,
    /// Points with a coordinate that is NaN or infinite: nothing returned.
    pub not_finite: usize,
    /// Points at exactly 0 0 0, as drivers write them where nothing returned.
    pub zeros: usize,
    /// Points of the robot itself, or too near.
    pub of_robot: usize,
    /// Points beyond the largest range.
    pub too_far: usize,
    /// Points at the distance that means "nothing returned", or farther.
    pub no_returns: usize,
    /// Points outside the range of the map's coordinates.
    pub beyond_map: usize,
}

impl SkippedPoints {
    /// Counts what `filter` skips of the points of a scan.
    pub fn of(points: &[Point], filter: &PointFilter) -> Self {
        let mut skipped = Self { points: points.len(), ..Self::default() };
        for &point in points {
            if !point.is_finite() {
                skipped.not_finite += 1;
            } else if !filter.is_return(point) {
                skipped.zeros += 1;
            } else if !filter.keeps(point) {
                *match () {
                    () if filter.is_of_robot(point) => &mut skipped.of_robot,
                    () if filter.is_no_return(point) => &mut skipped.no_returns,
                    () => &mut skipped.too_far,
                } += 1;
            }
        }
        skipped
    }

    /// How many points are skipped, for whatever reason.
    pub fn total(&self) -> usize {
        self.reasons().iter().map(|(count, _)| count).sum()
    }

    /// True when half of the points or more lie beyond the largest range or the map's range: a limit is wrong, or the
    /// unit.
    pub fn is_mostly_beyond(&self) -> bool {
        self.points > 0 && (self.too_far + self.beyond_map) * 2 >= self.points
    }

    /// The reason of a scan's verdict, with what was skipped where that may explain it: of a scan that is not accepted,
    /// or most of which lies beyond.
    pub fn explain(&self, is_accepted: bool, reason: &str) -> String {
        match self.total() > 0 && (!is_accepted || self.is_mostly_beyond()) {
            true => format!("{reason}; {self}"),
            false => reason.to_owned(),
        }
    }

    /// True of a verdict's reason that [says](Self::explain) what was skipped.
    pub fn is_told_in(reason: &str) -> bool {
        reason.contains(SKIPPED)
    }

    fn reasons(&self) -> [(usize, &'static str); 6] {
        [
            (self.not_finite, "not finite"),
            (self.zeros, "at 0 0 0"),
            (self.of_robot, "of the robot or too near"),
            (self.no_returns, "at no_return_m or farther"),
            (self.too_far, "beyond range_max_m"),
            (self.beyond_map, "beyond the map's range"),
        ]
    }
}

/// In words: `600 of 800 points skipped: 500 at 0 0 0, 100 not finite`.
impl Display for SkippedPoints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}{SKIPPED}", self.total(), self.points)?;
        let mut separator = ": ";
        for (count, reason) in self.reasons().into_iter().filter(|(count, _)| *count > 0) {
            write!(f, "{}{count} {reason}", std::mem::replace(&mut separator, ", "))?;
        }
        match self.is_mostly_beyond() {
            true => {
                write!(f, " (half of the scan or more lies beyond: check its unit, its frame and the limit)")
            }
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_counted_by_the_reason_for_which_they_are_skipped() {
        let filter = PointFilter {
            range_min_m: Some(0.5),
            range_max_m: Some(10.0),
            no_return_m: Some(50.0),
            ..PointFilter::default()
        };
        let points = [
            Point::new(1.0, 0.0, 0.0),
            Point::new(0.0, 0.0, 0.0),
            Point::new(-0.0, 0.0, -0.0),
            Point::new(0.1, 0.0, 0.0),
            Point::new(f32::NAN, 0.0, 0.0),
            Point::new(20.0, 0.0, 0.0),
            Point::new(0.0, 50.0, 0.0),
        ];
        let skipped = SkippedPoints::of(&points, &filter);
        let expected = "6 of 7 points skipped: 1 not finite, 2 at 0 0 0, 1 of the robot or too near, 1 at no_return_m or \
                        farther, 1 beyond range_max_m";
        assert_eq!(skipped.to_string(), expected);
        let kept = SkippedPoints::of(&points, &PointFilter { keep_zeros: true, ..PointFilter::default() });
        assert_eq!((kept.zeros, kept.total()), (0, 1));
    }

    #[test]
    fn a_scan_of_which_half_lies_beyond_is_said_to_be_so() {
        let mostly = SkippedPoints { points: 4, beyond_map: 1, too_far: 1, ..SkippedPoints::default() };
        assert!(mostly.to_string().contains("half of the scan or more lies beyond"), "{mostly}");
        assert!(!SkippedPoints { points: 5, ..mostly }.to_string().contains("half"));
        assert!(!SkippedPoints::default().is_mostly_beyond());
    }
}
