//! Where a scan is thought to have been taken.

use crate::geometry::Pose;

/// Where a scan is thought to have been taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Guess {
    /// At the robot's last accepted pose: the paper's guess.
    #[default]
    Last,
    /// At this pose: map_from_sensor.
    Pose(Pose),
    /// This far from the robot's last accepted pose: last_from_sensor, as odometry tells.
    Motion(Pose),
    /// As far from the last accepted pose as that is from the one before it, or in proportion to the time that passed
    /// where all three scans tell it. At the last accepted pose where a scan between these two was refused.
    ConstantVelocity,
}

/// A pose and its time, nanoseconds since the Unix epoch.
pub(super) type Stamped<'a> = (&'a Pose, Option<i64>);
