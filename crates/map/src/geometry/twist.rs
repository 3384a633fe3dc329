//! Velocities that stay constant.

use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3};

use super::pose::Pose;

/// The velocity of a frame that moves, constant in the frame's own axes: a robot that drives along an arc has one.
///
/// It is the element of se(3) of which [`Twist::motion`] is the exponential and [`Twist::of_motion`] the logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Velocity along the frame's axes, meters a second.
    pub linear: Vector3<f64>,
    /// Velocity of rotation about the frame's axes, radians a second.
    pub angular: Vector3<f64>,
}

impl Twist {
    /// The twist with which a frame makes `motion` (before_from_after) in `seconds`, turning by half a turn at most.
    ///
    /// Not finite where `seconds` is 0.
    pub fn of_motion(motion: &Pose, seconds: f64) -> Self {
        let turn = motion.rotation.scaled_axis();
        let (angle, cross) = (turn.norm(), turn.cross_matrix());
        // (1 - a/2 cot a/2) / a^2, of which 1/12 is the limit.
        let second = match angle < SMALL_ANGLE {
            true => 1.0 / 12.0,
            false => (1.0 - angle / 2.0 / (angle / 2.0).tan()) / (angle * angle),
        };
        let inverse = Matrix3::identity() - cross / 2.0 + cross * cross * second;
        Self { linear: inverse * motion.translation.vector / seconds, angular: turn / seconds }
    }

    /// How a frame with this twist moves within `seconds`, which may be negative: before_from_after.
    pub fn motion(&self, seconds: f64) -> Pose {
        let turn = self.angular * seconds;
        let (angle, cross) = (turn.norm(), turn.cross_matrix());
        let (first, second) = match angle < SMALL_ANGLE {
            true => (0.5, 1.0 / 6.0),
            false => {
                let square = angle * angle;
                ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
            }
        };
        let left = Matrix3::identity() + cross * first + cross * cross * second;
        let translation = Translation3::from(left * self.linear * seconds);
        Pose::from_parts(translation, UnitQuaternion::from_scaled_axis(turn))
    }
}

/// Below this angle, radians, the series' first terms are exact to the last digit.
const SMALL_ANGLE: f64 = 1e-5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::pose::pose_difference;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_motion_is_made_by_its_twist(numbers in prop::array::uniform6(-1.5..1.5f64), seconds in 0.01..3.0f64) {
            let [x, y, z, a, b, c] = numbers;
            for scale in [1.0, 1e-3, 1e-6, 0.0] {
                let motion = Pose::new(Vector3::new(x, y, z), Vector3::new(a, b, c) * scale);
                let twist = Twist::of_motion(&motion, seconds);
                let (meters, degrees) = pose_difference(&motion, &twist.motion(seconds));
                prop_assert!(meters < 1e-9 && degrees < 1e-5, "{meters} m, {degrees} degrees");
                // In two halves it is the same, and backwards it is the inverse.
                let halves = twist.motion(seconds / 2.0) * twist.motion(seconds / 2.0);
                let (meters, degrees) = pose_difference(&motion, &halves);
                prop_assert!(meters < 1e-9 && degrees < 1e-5, "{meters} m, {degrees} degrees");
                let back = motion * twist.motion(-seconds);
                let (meters, degrees) = pose_difference(&back, &Pose::identity());
                prop_assert!(meters < 1e-9 && degrees < 1e-5, "{meters} m, {degrees} degrees");
            }
        }
    }

    #[test]
    fn a_robot_that_drives_an_arc_comes_round_a_circle() {
        let twist = Twist { linear: Vector3::new(2.0, 0.0, 0.0), angular: Vector3::new(0.0, 0.0, 1.0) };
        let half_turn = twist.motion(std::f64::consts::PI);
        assert!((half_turn.translation.vector - Vector3::new(0.0, 4.0, 0.0)).norm() < 1e-12);
    }
}
