//! Rides: how a robot carries its sensor along a route, step by step.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Translation3, UnitQuaternion};

use super::route::Route;
use mrol_map::geometry::{Pose, pose_difference};

/// Factor by which a step that is too long, or turns too far, is shortened repeatedly.
const SHORTENING: f64 = 0.9;
/// Number of glances to each side in a lap; at the corners the sensor then looks where the robot goes, not at the wall
/// beside it.
const GLANCES: f64 = 3.0;
/// Periods of roll, pitch and heave along the route, meters; no two have a small common multiple.
const ROLL_WAY_M: f64 = 2.9;
const PITCH_WAY_M: f64 = 3.7;
const HEAVE_WAY_M: f64 = 2.3;
/// Amplitude of the heave, meters.
const HEAVE_M: f64 = 0.01;

/// How a robot carries its sensor along a route.
pub(super) struct Ride {
    pub(super) route: Route,
    /// Mean height of the sensor above the floor, meters.
    pub(super) height_m: f64,
    /// Angle by which the sensor looks down, degrees.
    pub(super) pitch_down_deg: f64,
    /// True for camera axes: x to the right, y down, z forward.
    pub(super) is_camera: bool,
    /// Amplitude of the glances to both sides, degrees.
    pub(super) glance_deg: f64,
    /// Amplitude of roll and pitch, degrees.
    pub(super) sway_deg: f64,
    /// Largest length of a step, meters.
    pub(super) step_max_m: f64,
    /// Largest rotation of a step, degrees.
    pub(super) turn_max_deg: f64,
}

impl Ride {
    /// The first `steps` poses of the sensor, map_from_sensor, over as many laps as needed.
    pub(super) fn poses(&self, steps: usize) -> Vec<Pose> {
        let mut way_m = 0.0;
        std::iter::repeat_with(|| {
            let map_from_sensor = self.map_from_sensor(way_m);
            way_m += self.step_m(&map_from_sensor, way_m);
            map_from_sensor
        })
        .take(steps)
        .collect()
    }

    /// The longest step from `way_m` that keeps both limits.
    fn step_m(&self, from: &Pose, way_m: f64) -> f64 {
        let mut step_m = self.step_max_m;
        while !self.is_within_limits(from, &self.map_from_sensor(way_m + step_m)) {
            step_m *= SHORTENING;
        }
        step_m
    }

    fn is_within_limits(&self, from: &Pose, to: &Pose) -> bool {
        let (meters, degrees) = pose_difference(from, to);
        meters <= self.step_max_m && degrees <= self.turn_max_deg
    }

    pub(super) fn map_from_sensor(&self, way_m: f64) -> Pose {
        let swing = |amplitude: f64, every_m: f64| amplitude * (way_m / every_m * TAU).sin();
        let [x, y] = self.route.position(way_m);
        let z = self.height_m + swing(HEAVE_M, HEAVE_WAY_M);
        let roll = swing(self.sway_deg, ROLL_WAY_M).to_radians();
        let pitch = (self.pitch_down_deg + swing(self.sway_deg, PITCH_WAY_M)).to_radians();
        let glance_right = swing(self.glance_deg, self.route.length_m() / GLANCES).to_radians();
        let yaw = self.route.yaw(way_m) - glance_right;
        let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        Pose::from_parts(Translation3::new(x, y, z), rotation * self.mount())
    }

    /// Rotation from the sensor's axes to the robot's: x forward, y to the left, z up.
    fn mount(&self) -> UnitQuaternion<f64> {
        if self.is_camera {
            UnitQuaternion::from_euler_angles(-FRAC_PI_2, 0.0, -FRAC_PI_2)
        } else {
            UnitQuaternion::identity()
        }
    }
}
