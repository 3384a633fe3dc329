//! Deskewing: the points of a sensor that moved during its sweep, as it would have seen them at one moment.
//!
//! A spinning lidar takes 0.1 s for a turn; at 2 m/s and 1 rad/s the last points of a turn are off by 0.2 m and 6
//! degrees against the first. Where each point has its time, and the sensor's motion is known, that is undone: a point
//! that was measured `t` seconds after the scan's timestamp moves by the sensor's motion over these seconds.

use super::guess::Stamped;
use crate::geometry::{Point, Pose, Twist};

/// When a motion is believed that scans are deskewed with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeskewSettings {
    /// Longest time since the robot's last pose over which its velocity counts as constant, seconds. 2.
    pub interval_max_s: f64,
    /// Largest speed, meters a second. A guess that asks for more is off. 60.
    pub speed_max_m_per_s: f64,
    /// Fastest rotation, radians a second. 10.
    pub rotation_max_rad_per_s: f64,
}

impl Default for DeskewSettings {
    fn default() -> Self {
        Self { interval_max_s: 2.0, speed_max_m_per_s: 60.0, rotation_max_rad_per_s: 10.0 }
    }
}

impl DeskewSettings {
    /// The velocity of a sensor that was at the pose `last` and is at `now` (map_from_sensor, with their times); none
    /// where a time is not known, or the velocity is not believed.
    pub(super) fn velocity(&self, last: Stamped<'_>, now: Stamped<'_>) -> Option<Twist> {
        let (before_ns, now_ns) = (last.1?, now.1?);
        let seconds = now_ns.checked_sub(before_ns).filter(|ns| *ns > 0)? as f64 * 1e-9;
        if seconds > self.interval_max_s {
            return None;
        }
        let twist = Twist::of_motion(&last.0.inv_mul(now.0), seconds);
        let is_believed = twist.linear.norm() <= self.speed_max_m_per_s
            && twist.angular.norm() <= self.rotation_max_rad_per_s;
        is_believed.then_some(twist)
    }
}

/// The points (sensor frame, each at its own time) in the sensor frame at the scan's timestamp, where the sensor moves
/// with `velocity`; `times_s` are seconds from the timestamp, one for each point.
pub fn deskewed(points: &[Point], times_s: &[f32], velocity: &Twist) -> Vec<Point> {
    // The lasers of a lidar fire together: the motion is often that of the point before.
    let (mut time_s, mut motion) = (0.0, Pose::identity());
    let deskew = |(point, &point_time_s): (&Point, &f32)| {
        if point_time_s != time_s {
            (time_s, motion) = (point_time_s, velocity.motion(f64::from(point_time_s)));
        }
        Point::from(motion * point.to_f64())
    };
    points.iter().zip(times_s).map(deskew).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn a_point_that_stands_still_is_where_it_was_seen_at_the_timestamp() {
        let velocity = Twist { linear: Vector3::new(2.0, 0.1, 0.0), angular: Vector3::new(0.1, 0.0, 1.0) };
        let still = Point3::new(5.0, -3.0, 1.0);
        let times_s: Vec<f32> = (-10..=10).map(|i| i as f32 * 0.01).collect();
        let seen_at =
            |time_s: &f32| Point::from(velocity.motion(f64::from(*time_s)).inverse_transform_point(&still));
        let points: Vec<Point> = times_s.iter().map(seen_at).collect();
        assert!((points[20].to_f64() - still).norm() > 0.2);
        for point in deskewed(&points, &times_s, &velocity) {
            assert!((point.to_f64() - still).norm() < 1e-5, "{point:?}");
        }
    }

    #[test]
    fn a_velocity_is_believed_within_bounds_alone() {
        let settings = DeskewSettings::default();
        let origin = Pose::identity();
        let velocity = |meters, before, now| {
            settings.velocity((&origin, before), (&Pose::translation(meters, 0.0, 0.0), now))
        };
        let second = 1_000_000_000;
        assert_eq!(velocity(3.0, Some(second), Some(2 * second)).unwrap().linear.x, 3.0);
        assert!(velocity(3.0, None, Some(second)).is_none());
        assert!(velocity(3.0, Some(second), None).is_none());
        assert!(velocity(3.0, Some(second), Some(second)).is_none());
        assert!(velocity(3.0, Some(2 * second), Some(second)).is_none());
        assert!(velocity(3.0, Some(i64::MIN), Some(i64::MAX)).is_none());
        assert!(velocity(3.0, Some(0), Some(3 * second)).is_none());
        assert!(velocity(61.0, Some(0), Some(second)).is_none());
        assert!(velocity(f64::NAN, Some(0), Some(second)).is_none());
    }
}
