//! How a sensor is mounted: what is known of a map's first pose if nobody tells it.

use nalgebra::{Quaternion, UnitQuaternion};

use crate::geometry::Pose;
use crate::util::Keyword;

/// Largest height of a sensor above the floor that is taken for one, meters.
pub const SENSOR_HEIGHT_MAX_M: f64 = 1000.0;

/// Which way the axes of a sensor's frame point, by ROS REP 103.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensorAxes {
    /// x ahead, y to the left, z up: a lidar, or a robot's base.
    #[default]
    Robot,
    /// x to the right, y down, z ahead: a camera.
    Optical,
}

impl Keyword for SensorAxes {
    const ALL: &'static [Self] = &[Self::Robot, Self::Optical];

    fn as_str(self) -> &'static str {
        match self {
            Self::Robot => "robot",
            Self::Optical => "optical",
        }
    }
}

impl SensorAxes {
    /// The turn from these axes to x ahead, y to the left, z up.
    fn robot_from_sensor(self) -> UnitQuaternion<f64> {
        match self {
            Self::Robot => UnitQuaternion::identity(),
            Self::Optical => UnitQuaternion::new_unchecked(Quaternion::new(0.5, -0.5, 0.5, -0.5)),
        }
    }
}

/// How a sensor is mounted on a robot that stands on a level floor.
///
/// It decides one thing: where the first scan of an empty map was taken if the request does not say. So the map's z
/// axis points up, its x axis ahead, and its origin lies on the floor below the sensor. No point is turned: all poses
/// stay those of the sensor's own frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorMount {
    /// Which way the axes of its frame point.
    pub axes: SensorAxes,
    /// Its height above the floor, meters.
    pub height_m: f64,
}

impl SensorMount {
    /// Where the first scan of an empty map was taken if nobody says: map_from_sensor.
    pub fn first_pose(self) -> Pose {
        let turn = self.axes.robot_from_sensor();
        Pose::from_parts(nalgebra::Translation3::new(0.0, 0.0, self.height_m), turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn what_a_camera_calls_ahead_right_and_down_is_so_in_the_map() {
        let map_from_sensor = SensorMount { axes: SensorAxes::Optical, height_m: 1.2 }.first_pose();
        let cases =
            [(Vector3::z(), Vector3::x()), (Vector3::x(), -Vector3::y()), (Vector3::y(), -Vector3::z())];
        for (in_sensor, in_map) in cases {
            assert!((map_from_sensor.rotation * in_sensor - in_map).norm() < 1e-12, "{in_sensor}");
        }
        assert_eq!(map_from_sensor.translation.vector, Vector3::new(0.0, 0.0, 1.2));
        assert_eq!(SensorMount::default().first_pose(), Pose::identity());
    }
}
