//! Filtering of a scan's points.

use super::error::MappingError;
use super::ray_ends::RayEnds;
use crate::geometry::Point;
use crate::map::RobotName;
use crate::scan::{PointFilter, SkippedPoints};

/// The points of a scan, told apart by its robot's filter; those at which nothing returned are left out: they
/// are not finite, or at exactly 0 0 0.
#[derive(Debug, Clone, PartialEq)]
pub struct FilteredPoints {
    /// Those that show the robot's surroundings.
    surroundings: TimedPoints,
    /// Up to where points that are too far tell that nothing was met, see [`PointFilter::passed_to`].
    no_returns: TimedPoints,
    /// Up to where rays ran whose points are too far, see [`PointFilter::beyond_to`].
    beyond: TimedPoints,
    /// Those of the robot itself, or too near: what lies behind them was not seen.
    of_robot: TimedPoints,
    /// How many points do not show the surroundings, and why.
    pub skipped: SkippedPoints,
    filter: PointFilter,
}

/// Points, and when each was measured, where the scan tells.
#[derive(Debug, Clone, PartialEq)]
struct TimedPoints {
    points: Vec<Point>,
    times_s: Option<Vec<f32>>,
}

impl TimedPoints {
    /// What `select` makes of the points; those whose time is no number are left out.
    fn of(all: RayEnds<'_>, select: impl Fn(Point) -> Option<Point>) -> Self {
        let Some(times_s) = all.times_s else {
            let points = all.points.iter().filter_map(|&point| select(point)).collect();
            return Self { points, times_s: None };
        };
        let timed = all.points.iter().zip(times_s).filter(|(_, time_s)| time_s.is_finite());
        let (points, times_s) =
            timed.filter_map(|(&point, &time_s)| select(point).map(|point| (point, time_s))).unzip();
        Self { points, times_s: Some(times_s) }
    }

    fn as_ends(&self) -> RayEnds<'_> {
        RayEnds { points: &self.points, times_s: self.times_s.as_deref() }
    }
}

impl FilteredPoints {
    /// Filters the points of a scan. A point that is not finite means "no return" in every depth camera: it is left
    /// out, or an error where the scan is `strict`. Times that are no numbers are those of points that do not count.
    ///
    /// # Errors
    /// No point is left, a strict scan has a point that is not finite, or the filter is not valid.
    pub fn of(
        all: RayEnds<'_>,
        filter: PointFilter,
        robot: &RobotName,
        strict: bool,
    ) -> Result<Self, MappingError> {
        let points = all.points.len();
        let not_finite = all.points.iter().filter(|point| !point.is_finite()).count();
        if strict && not_finite > 0 {
            let index = all.points.iter().position(|point| !point.is_finite()).unwrap_or_default();
            return Err(MappingError::NotFinite { index, count: not_finite });
        }
        let filter = filter.checked()?;
        let skipped = SkippedPoints::of(all.points, &filter);
        if skipped.not_finite + skipped.zeros == points {
            return Err(MappingError::NoReturns { points, zeros: skipped.zeros });
        }
        let surroundings = TimedPoints::of(all, |point| filter.keeps(point).then_some(point));
        if surroundings.points.is_empty() {
            let filter = filter.to_string();
            return Err(MappingError::AllFiltered { points, filter, skipped, robot: robot.clone() });
        }
        Ok(Self {
            surroundings,
            no_returns: TimedPoints::of(all, |point| filter.passed_to(point)),
            beyond: TimedPoints::of(all, |point| filter.beyond_to(point)),
            of_robot: TimedPoints::of(all, |point| filter.is_of_robot(point).then_some(point)),
            skipped,
            filter,
        })
    }

    /// Those that show the robot's surroundings.
    pub fn surroundings(&self) -> RayEnds<'_> {
        self.surroundings.as_ends()
    }

    /// Up to where points tell that nothing was met.
    pub fn no_returns(&self) -> RayEnds<'_> {
        self.no_returns.as_ends()
    }

    /// Up to where rays ran that ended beyond the largest range.
    pub fn beyond(&self) -> RayEnds<'_> {
        self.beyond.as_ends()
    }

    /// Those of the robot itself, or too near.
    pub fn of_robot(&self) -> RayEnds<'_> {
        self.of_robot.as_ends()
    }

    /// True of a point (sensor frame) that passes the filter.
    pub fn keeps(&self, point: Point) -> bool {
        self.filter.keeps(point)
    }
}
