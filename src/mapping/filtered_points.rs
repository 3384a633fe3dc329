//! Filtering of a scan's points.

use super::MappingError;
use crate::geometry::Point;
use crate::map::RobotName;
use crate::scan::PointFilter;

/// The points of a scan that show its robot's surroundings: finite, and kept by the robot's filter.
#[derive(Debug, Clone, PartialEq)]
pub struct FilteredPoints {
    /// The points, sensor frame.
    pub points: Vec<Point>,
    /// When each was measured, seconds from the scan's timestamp, where the scan tells.
    pub times_s: Option<Vec<f32>>,
    /// Up to where points tell that nothing was met, see [`PointFilter::no_return_m`]: none of `points`.
    pub no_returns: Vec<Point>,
    /// When each of these was measured, where the scan tells.
    pub no_return_times_s: Option<Vec<f32>>,
    /// How many points were left out.
    pub skipped: usize,
    filter: PointFilter,
}

impl FilteredPoints {
    /// Filters the points of a scan (sensor frame). A point that is not finite means "no return" in every depth camera:
    /// it is left out, or an error where the scan is `strict`. `times_s` are those of all points, as many as these are.
    ///
    /// # Errors
    /// No point is left, a strict scan has a point that is not finite, or the filter is not valid.
    pub fn of(
        all: &[Point],
        times_s: Option<&[f32]>,
        filter: PointFilter,
        robot: &RobotName,
        strict: bool,
    ) -> Result<Self, MappingError> {
        let points: Vec<Point> = all.iter().copied().filter(|point| point.is_finite()).collect();
        let not_finite = all.len() - points.len();
        if strict && not_finite > 0 {
            let index = all.iter().position(|point| !point.is_finite()).unwrap_or_default();
            return Err(MappingError::NotFinite { index, count: not_finite });
        }
        if points.is_empty() {
            return Err(MappingError::NoReturns { points: all.len() });
        }
        let filter = filter.checked()?;
        let points: Vec<Point> = points.into_iter().filter(|&point| filter.keeps(point)).collect();
        if points.is_empty() {
            let filter = filter.to_string();
            return Err(MappingError::AllFiltered { points: all.len(), filter, robot: robot.clone() });
        }
        let of_points = times_s.map(|times_s| {
            let timed = all.iter().zip(times_s);
            timed
                .filter(|&(&point, _)| point.is_finite() && filter.keeps(point))
                .map(|(_, &time)| time)
                .collect()
        });
        let no_returns = all.iter().filter_map(|&point| filter.no_return(point)).collect();
        let no_return_times_s = times_s.map(|times_s| {
            let timed = all.iter().zip(times_s);
            timed.filter(|&(&point, _)| filter.no_return(point).is_some()).map(|(_, &time)| time).collect()
        });
        let skipped = all.len() - points.len();
        Ok(Self { points, times_s: of_points, no_returns, no_return_times_s, skipped, filter })
    }

    /// True of a point (sensor frame) that passes the filter.
    pub fn keeps(&self, point: Point) -> bool {
        point.is_finite() && self.filter.keeps(point)
    }
}
