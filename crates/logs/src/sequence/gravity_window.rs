//! The direction of gravity by an accelerometer.

use std::collections::VecDeque;

use mrol_map::align::localize::{Gravity, MAP_DOWN};
use mrol_map::geometry::Pose;
use nalgebra::Vector3;

/// Accelerations are averaged over so long before a cloud, nanoseconds.
const WINDOW_NS: i64 = 200_000_000;
/// Accelerations that are kept, at most.
const KEPT_MAX: usize = 2000;
/// One g, m/s^2.
const G: f64 = 9.80665;
/// How far the length may be from 1 g, as a share of it.
const TOLERANCE: f64 = 0.03;

/// The accelerations of the last fifth of a second.
#[derive(Debug, Clone, Default)]
pub(super) struct GravityWindow {
    accelerations: VecDeque<(i64, Vector3<f64>)>,
}

impl GravityWindow {
    /// Notes what the accelerometer reads at a time, in its own frame.
    pub(super) fn note(&mut self, stamp_ns: i64, acceleration: [f64; 3]) {
        self.accelerations.push_back((stamp_ns, acceleration.into()));
        if self.accelerations.len() > KEPT_MAX {
            self.accelerations.pop_front();
        }
    }

    /// True where the accelerometer was heard of at a time or later.
    pub(super) fn reaches(&self, stamp_ns: i64) -> bool {
        self.accelerations.back().is_some_and(|(at_ns, _)| *at_ns >= stamp_ns)
    }

    /// The direction of gravity in the sensor frame before a time; none while it reads anything but 1 g, in m/s^2 or in
    /// g.
    pub(super) fn at(&self, stamp_ns: i64, sensor_from_imu: &Pose) -> Option<Gravity> {
        let is_near = |at_ns: i64| (0..=WINDOW_NS).contains(&stamp_ns.saturating_sub(at_ns));
        let near = self.accelerations.iter().filter(|(at_ns, _)| is_near(*at_ns));
        let (sum, count) = near.fold((Vector3::zeros(), 0), |(sum, n), (_, a)| (sum + a, n + 1));
        let up = sum / f64::from(count.max(1));
        let is_g = |one_g: f64| (up.norm() / one_g - 1.0).abs() <= TOLERANCE;
        if !is_g(G) && !is_g(1.0) {
            return None;
        }
        Gravity::new((sensor_from_imu.rotation * -up).into(), MAP_DOWN).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn gravity_is_told_in_the_sensor_frame_while_it_is_1_g_in_either_unit() {
        let turned = Pose::from_parts(
            nalgebra::Translation3::new(1.0, 2.0, 3.0),
            UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0),
        );
        for (one_g, is_told) in [(G, true), (1.0, true), (G * 1.029, true), (G * 1.031, false), (0.0, false)]
        {
            let mut window = GravityWindow::default();
            window.note(0, [7.0, 0.0, 0.0]);
            window.note(1_000_000_000, [0.0, 0.0, one_g]);
            let gravity = window.at(1_100_000_000, &turned);
            assert_eq!(gravity.is_some(), is_told, "{one_g}");
            if let Some(gravity) = gravity {
                assert!((gravity.in_sensor()[2] - 1.0).abs() < 1e-12, "the accelerometer is upside down");
            }
        }
        assert!(GravityWindow::default().at(0, &turned).is_none());
    }

    #[test]
    fn gravity_is_that_of_the_table_that_the_node_of_ros_follows_too() {
        let table = include_str!("../../tests/fixtures/rules/gravity.txt");
        let numbers = |text: &str| -> Vec<f64> {
            text.split_whitespace().map(|number| number.parse().unwrap()).collect()
        };
        let rows: Vec<_> = table.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
        assert!(rows.len() > 10);
        for row in rows {
            let columns: Vec<&str> = row.split(';').map(str::trim).collect();
            let [name, readings, time_ms, turn, expected] = columns[..] else { panic!("{row}") };
            let mut window = GravityWindow::default();
            for reading in readings.split(',').filter(|reading| !reading.is_empty()) {
                let of = numbers(reading);
                window.note(of[0] as i64 * 1_000_000, [of[1], of[2], of[3]]);
            }
            let q = numbers(turn);
            let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]));
            let sensor_from_imu = Pose::from_parts(nalgebra::Translation3::identity(), turn);
            match window.at(numbers(time_ms)[0] as i64 * 1_000_000, &sensor_from_imu) {
                Some(gravity) => {
                    assert_ne!(expected, "none", "{name}");
                    let expected = Vector3::from_vec(numbers(expected));
                    let found = Vector3::from(gravity.in_sensor()).normalize();
                    assert!((found - expected).norm() < 1e-6, "{name}: {found}");
                }
                None => assert_eq!(expected, "none", "{name}"),
            }
        }
    }
}
