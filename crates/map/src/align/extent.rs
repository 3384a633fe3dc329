//! The points of a scan that are near enough to the sensor to lie on any map.

use std::borrow::Cow;

use crate::geometry::Point;
use crate::util::StopSignal;

/// Points between two checks of the stop signal: far below a millisecond.
const POINTS_PER_STOP_CHECK: usize = 64 << 10;

/// The points within `extent_m` of the sensor. An ordinary scan has no others and is returned without a copy.
///
/// Points that are farther away or not finite lie on no map wherever the sensor is, and a single one of them would
/// dominate ranges and sums of squares. Once stopped, the result is incomplete.
pub(super) fn within_extent<'a>(
    points: &'a [Point],
    extent_m: f64,
    stop: StopSignal<'_>,
) -> Cow<'a, [Point]> {
    let is_near = |point: &Point| point.to_f64().coords.norm() <= extent_m;
    let mut near: Option<Vec<Point>> = None;
    for (chunk, points_of_chunk) in points.chunks(POINTS_PER_STOP_CHECK).enumerate() {
        let before = &points[..chunk * POINTS_PER_STOP_CHECK];
        if stop.is_stopped() {
            return near.map_or(Cow::Borrowed(before), Cow::Owned);
        }
        if near.is_none() && !points_of_chunk.iter().all(is_near) {
            near = Some(before.to_vec());
        }
        if let Some(near) = &mut near {
            near.extend(points_of_chunk.iter().filter(|point| is_near(point)));
        }
    }
    near.map_or(Cow::Borrowed(points), Cow::Owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_the_extent_goes_and_nothing_is_copied_where_all_is_within() {
        let wall: Vec<Point> = (0..200_000).map(|i| Point::new(i as f32 * 1e-3, 0.0, 1.0)).collect();
        assert!(
            matches!(within_extent(&wall, 1e3, StopSignal::NEVER), Cow::Borrowed(all) if all.len() == wall.len())
        );
        let far = [1e30, f32::MAX, f32::INFINITY, f32::NAN, 1001.0].map(|x| Point::new(x, 0.0, 0.0));
        let mut mixed = wall.clone();
        for (i, point) in far.into_iter().enumerate() {
            mixed.insert(i * 40_000, point);
        }
        assert_eq!(*within_extent(&mixed, 1e3, StopSignal::NEVER), *wall);
        let looks = std::cell::Cell::new(0);
        let count = || looks.replace(looks.get() + 1) == usize::MAX;
        within_extent(&mixed, 1e3, StopSignal::when(&count));
        assert_eq!(looks.get(), mixed.len().div_ceil(POINTS_PER_STOP_CHECK));
    }
}
