//! Scans as they are sent to be mapped.

use std::borrow::Cow;

use super::guess::Guess;
use super::ray_ends::RayEnds;
use crate::align::PoseCovariance;
use crate::align::localize::Gravity;
use crate::geometry::{Point, Twist};
use crate::map::{RobotName, SessionName};
use crate::visibility::SensorRays;

/// A scan to map.
#[derive(Debug, Clone)]
pub struct Scan<'a> {
    /// The robot that took it.
    pub robot: &'a RobotName,
    /// The run of the robot's software that sent it.
    pub session: SessionName,
    /// The robot's own number of the scan, unique in its session.
    pub scan_id: Option<u64>,
    /// When the scan was taken, nanoseconds since the Unix epoch.
    pub timestamp_ns: Option<i64>,
    /// The scan's points in the sensor frame, meters, all of them finite.
    pub points: &'a [Point],
    /// When each of the points was measured, seconds from `timestamp_ns` (negative before it), where the sensor moved
    /// meanwhile: the scan is deskewed. As many as points; none where they were measured at once.
    pub times_s: Option<&'a [f32]>,
    /// Up to where nothing was met in other directions: they are seen through, and no voxels.
    pub no_returns: RayEnds<'a>,
    /// Up to where rays ran that ended beyond the largest range: they are seen through, and no voxels.
    pub beyond: RayEnds<'a>,
    /// Where rays ended at the robot itself: no voxels, and what lies behind them was not seen.
    pub of_robot: RayEnds<'a>,
    /// How the sensor's rays lie, where the robot's sensor is known and all the scan's ends [confirm
    /// it](SensorRays::confirmed); none: how densely they lie is found out from the points.
    pub sensor: Option<SensorRays>,
    /// Points that were left out before, see [`FilteredPoints`](super::FilteredPoints).
    pub points_skipped: usize,
    /// Direction of gravity, as an accelerometer tells.
    pub gravity: Option<Gravity>,
    /// Where it is thought to have been taken.
    pub guess: Guess,
    /// How far off the guess may be.
    pub guess_covariance: Option<PoseCovariance>,
    /// The guess is taken as it is, without aligning.
    pub at_guess: bool,
    /// Insert the scan where it was found even if it does not fit there.
    pub force: bool,
    /// Digest of the request, which tells the same scan sent again from another one under its id.
    pub digest: u64,
}

impl<'a> Scan<'a> {
    /// The points in the sensor frame at the scan's timestamp, where the sensor moved with `velocity`.
    pub(super) fn points_at(&self, velocity: Option<&Twist>) -> Cow<'a, [Point]> {
        RayEnds { points: self.points, times_s: self.times_s }.at(velocity)
    }

    /// How far a point lies, at most, from where it is with another velocity, meters.
    pub(super) fn points_moved_m(&self, velocity: Option<&Twist>, other: Option<&Twist>) -> f64 {
        let [points, others] = [velocity, other].map(|velocity| self.points_at(velocity));
        let moved_m = points.iter().zip(&*others).map(|(a, b)| (a.to_f64() - b.to_f64()).norm());
        moved_m.fold(0.0, f64::max)
    }

    /// [`Scan::points_at`], and where rays ended at the robot itself: all that stood in the way of one.
    pub(super) fn met_at(&self, velocity: Option<&Twist>) -> Cow<'a, [Point]> {
        let mut met = self.points_at(velocity);
        if !self.of_robot.points.is_empty() {
            met.to_mut().extend_from_slice(&self.of_robot.at(velocity));
        }
        met
    }

    /// How far the sensor moved with `velocity`, at most, between the scan's timestamp and a ray, meters.
    pub(super) fn moved_m(&self, velocity: Option<&Twist>) -> f64 {
        let points = RayEnds { points: self.points, times_s: self.times_s };
        [points, self.no_returns, self.beyond, self.of_robot]
            .map(|ends| ends.moved_m(velocity))
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// A scan without number and time, thought to have been taken at the robot's last pose.
    ///
    /// `points` are in the sensor frame and finite.
    pub fn new(robot: &'a RobotName, points: &'a [Point]) -> Self {
        Self {
            robot,
            session: SessionName::default(),
            scan_id: None,
            timestamp_ns: None,
            points,
            times_s: None,
            no_returns: RayEnds::default(),
            beyond: RayEnds::default(),
            of_robot: RayEnds::default(),
            sensor: None,
            points_skipped: 0,
            gravity: None,
            guess: Guess::Last,
            guess_covariance: None,
            at_guess: false,
            force: false,
            digest: 0,
        }
    }
}
