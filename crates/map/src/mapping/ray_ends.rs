//! Ray ends: points of a scan, and when each was measured.

use std::borrow::Cow;

use super::deskew::deskewed;
use crate::geometry::{Point, Twist};

/// Where rays of a scan ended, and when each was taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RayEnds<'a> {
    /// The ends (sensor frame at the time of each, finite), meters.
    pub points: &'a [Point],
    /// Seconds from the scan's timestamp (negative before it), as many as ends; none where all were taken at once.
    pub times_s: Option<&'a [f32]>,
}

impl<'a> RayEnds<'a> {
    /// The ends in the sensor frame at the scan's timestamp, where the sensor moved with `velocity`.
    pub(super) fn at(self, velocity: Option<&Twist>) -> Cow<'a, [Point]> {
        match self.times_s.zip(velocity) {
            Some((times_s, velocity)) => deskewed(self.points, times_s, velocity).into(),
            None => self.points.into(),
        }
    }

    /// How far the sensor moved with `velocity`, at most, between the scan's timestamp and a ray, meters.
    pub(super) fn moved_m(self, velocity: Option<&Twist>) -> f64 {
        let times_s = self.times_s.unwrap_or_default();
        let longest_s = times_s.iter().fold(0.0, |longest: f32, time_s| longest.max(time_s.abs()));
        velocity.map_or(0.0, |velocity| velocity.linear.norm() * f64::from(longest_s))
    }
}
