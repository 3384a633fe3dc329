//! The poses that guesses stand for, by where robots were seen.

use super::error::MappingError;
use super::guess::{Guess, Stamped};
use super::sightings::Sightings;
use crate::geometry::{Pose, extrapolate};
use crate::map::{MappedScan, RobotName, Trajectory};

impl Guess {
    /// The pose that the guess stands for: map_from_sensor.
    ///
    /// A robot without an accepted scan is at `first_pose`, which is none of a map that is not empty. The last accepted
    /// pose of a robot that stands still is where it was seen last, though that scan is not kept.
    ///
    /// # Errors
    /// The guess needs an accepted scan of the robot, there is none, and the map is not empty.
    pub fn resolve(
        &self,
        robot: &RobotName,
        timestamp_ns: Option<i64>,
        trajectory: &Trajectory,
        sightings: &Sightings,
        first_pose: Option<Pose>,
    ) -> Result<Pose, MappingError> {
        let last_or_first = || match last_seen(robot, trajectory, sightings) {
            Some((map_from_sensor, _)) => Ok(map_from_sensor),
            None => first_pose.ok_or_else(|| MappingError::GuessRequired(robot.clone())),
        };
        match self {
            Self::Pose(map_from_sensor) => Ok(*map_from_sensor),
            Self::Last => last_or_first(),
            Self::Motion(last_from_sensor) => Ok(last_or_first()? * last_from_sensor),
            Self::ConstantVelocity => {
                let last = trajectory.last_of(robot);
                let standing = last.and_then(|last| Some((last, sightings.standing_since(last)?)));
                if let Some((last, standing)) = standing {
                    let standing = (&standing.map_from_sensor, standing.timestamp_ns);
                    return Ok(constant_velocity(stamped(last), standing, timestamp_ns));
                }
                match trajectory.last_two_of(robot) {
                    Some((last, before)) if !sightings.follows_refused(robot) => {
                        Ok(constant_velocity(stamped(before), stamped(last), timestamp_ns))
                    }
                    _ => last_or_first(),
                }
            }
        }
    }
}

/// Where a robot was last, with the time: standing still, or at its last stored scan.
pub(super) fn last_seen(
    robot: &RobotName,
    trajectory: &Trajectory,
    sightings: &Sightings,
) -> Option<(Pose, Option<i64>)> {
    let last = trajectory.last_of(robot)?;
    let standing = sightings.standing_since(last);
    let standing = standing.map(|standing| (standing.map_from_sensor, standing.timestamp_ns));
    Some(standing.unwrap_or((last.map_from_sensor, last.timestamp_ns)))
}

fn stamped(scan: &MappedScan) -> Stamped<'_> {
    (&scan.map_from_sensor, scan.timestamp_ns)
}

/// The pose of a robot that goes on as it went from `before` to `last`.
fn constant_velocity(before: Stamped<'_>, last: Stamped<'_>, timestamp_ns: Option<i64>) -> Pose {
    let share = match [before.1, last.1, timestamp_ns] {
        // Of timestamps as far apart as the numbers go, the difference is no i64.
        [Some(t0), Some(t1), Some(t2)] if t1 > t0 && t2 > t1 => {
            t2.abs_diff(t1) as f64 / t1.abs_diff(t0) as f64
        }
        _ => 1.0,
    };
    extrapolate(before.0, last.0, share)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, timestamp_ns: i64) -> MappedScan {
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::translation(x, 0.0, 0.0));
        MappedScan { timestamp_ns: Some(timestamp_ns), ..pose }
    }

    #[test]
    fn a_motion_goes_on_in_proportion_to_the_time_whatever_the_timestamps() {
        let x = |before, last, now| {
            constant_velocity(stamped(&at(0.0, before)), stamped(&at(1.0, last)), Some(now))
                .translation
                .vector
                .x
        };
        assert_eq!(x(0, 2, 3), 1.5);
        assert!((x(i64::MIN, 0, i64::MAX) - 2.0).abs() < 1e-9);
        assert_eq!(x(i64::MIN, i64::MAX - 1, i64::MAX), 1.0);
        assert_eq!(x(i64::MIN, i64::MIN + 1, i64::MAX), 1.0 + crate::geometry::EXTRAPOLATION_SHARE_MAX);
        assert_eq!(x(i64::MAX, i64::MIN, i64::MAX), 2.0, "a clock that went back tells no share");
    }
}
