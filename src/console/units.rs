//! Points that do not seem to be in meters.

use nalgebra::Point3;

use mrol_map::geometry::Point;
use mrol_map::scan::PointFilter;

/// Median range from which points are thought not to be in meters: sensors of robots reach some 500 m at most, and half
/// of a scan lies far nearer. A room in millimeters has thousands.
const MEDIAN_RANGE_MAX: f64 = 500.0;

/// Least ratio of the span of a scan to its median range. For a sensor that sees all sides it is 1 or more, for one of
/// a narrow field of view some 0.3. Points of a survey lie close together and far from 0: below 0.01.
const SPAN_RATIO_MIN: f64 = 0.1;

/// Share of the points at each end of an axis that do not count for the span: drivers write huge values where nothing
/// returned.
const ENDS: f64 = 0.01;

/// A sentence about points that are most likely in millimeters, with their median range and span; none for others. The
/// points lie in the sensor frame, and messages call them `name`.
pub(super) fn doubt_meters(name: &str, points: &[Point3<f64>]) -> Option<String> {
    let filter = PointFilter::default();
    let returns = || points.iter().filter(|point| filter.is_return(Point::from(**point)));
    let median_range = quantile(returns().map(|point| point.coords.norm()).collect(), 0.5)?;
    let span_of = |axis: usize| {
        let along = || returns().map(|point| point.coords[axis]).collect::<Vec<f64>>();
        Some(quantile(along(), 1.0 - ENDS)? - quantile(along(), ENDS)?)
    };
    let span = (0..3).filter_map(span_of).fold(0.0, f64::max);
    let is_doubtful = median_range > MEDIAN_RANGE_MAX && span >= SPAN_RATIO_MIN * median_range;
    is_doubtful.then(|| {
        format!(
            "{name}: the median range of its points is {median_range:.0} m, and they span {span:.0} m: are they in \
             millimeters? Points are read as meters; divide millimeters by 1000 first"
        )
    })
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
    fn room(half: f64) -> Vec<Point3<f64>> {
        let on_wall = |k: i32| {
            let angle = 0.1 * f64::from(k);
            Point3::new(half * angle.cos(), half * angle.sin(), 0.3 * half * (angle * 0.37).sin())
        };
        (0..200).map(on_wall).collect()
    }

    #[test]
    fn a_room_in_millimeters_is_told_with_its_median_range_and_span() {
        let mut millimeters = room(3000.0);
        millimeters.extend([Point3::new(1e30, 0.0, 0.0), Point3::origin(), Point3::new(f64::NAN, 0.0, 0.0)]);
        let said = doubt_meters("a.ply", &millimeters).unwrap();
        assert!(said.starts_with("a.ply: the median range") && said.contains("span 5997 m"), "{said}");
    }

    #[test]
    fn far_scans_surveys_and_nothing_are_not_doubted() {
        assert_eq!(doubt_meters("a", &room(3.0)), None);
        assert_eq!(doubt_meters("a", &room(400.0)), None);
        assert_eq!(doubt_meters("a", &[]), None);
        let survey: Vec<_> =
            room(80.0).iter().map(|p| p + nalgebra::Vector3::new(388e3, 3948e3, 12.0)).collect();
        assert_eq!(doubt_meters("a", &survey), None);
    }
}
