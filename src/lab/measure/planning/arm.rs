//! An arm of seven joints with a gripper, of the size of those that stand beside benches: 59 spheres in 11 links.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::place::{Surface, append};
use crate::geometry::Pose;
use crate::planning::{Body, Link, PlanningError, Sphere};

type Row = (usize, [f64; 3], [f64; 3], f64, usize);

/// Spheres in rows: link, ends of the row, radius (meters), how many.
const ROWS: [Row; 11] = [
    (0, [-0.06, 0.0, 0.06], [0.0, 0.0, 0.06], 0.08, 2),
    (1, [0.0, 0.0, -0.2], [0.0, -0.03, 0.0], 0.06, 5),
    (2, [0.0, -0.03, 0.02], [0.0, -0.18, 0.0], 0.06, 5),
    (3, [0.01, 0.0, -0.12], [0.08, 0.03, 0.0], 0.055, 6),
    (4, [-0.02, 0.02, 0.02], [-0.08, 0.1, 0.0], 0.055, 6),
    (5, [0.0, 0.04, -0.26], [0.0, 0.07, 0.0], 0.04, 14),
    (6, [0.01, 0.0, 0.0], [0.08, 0.02, 0.0], 0.05, 5),
    (7, [0.0, 0.0, 0.05], [0.03, 0.03, 0.08], 0.04, 4),
    (8, [0.0, -0.075, 0.03], [0.0, 0.075, 0.03], 0.028, 8),
    (9, [0.0, 0.03, 0.07], [0.0, 0.03, 0.1], 0.012, 2),
    (10, [0.0, -0.03, 0.07], [0.0, -0.03, 0.1], 0.012, 2),
];

/// Joints as modified Denavit-Hartenberg parameters: a (meters), alpha (radians), d (meters).
const JOINTS: [(f64, f64, f64); 7] = [
    (0.0, 0.0, 0.333),
    (0.0, -FRAC_PI_2, 0.0),
    (0.0, FRAC_PI_2, 0.316),
    (0.0825, FRAC_PI_2, 0.0),
    (-0.0825, -FRAC_PI_2, 0.384),
    (0.0, FRAC_PI_2, 0.0),
    (0.088, FRAC_PI_2, 0.0),
];
/// Least and largest angles of the joints, radians.
const ANGLES: [(f64, f64); 7] =
    [(-2.9, 2.9), (-1.76, 1.76), (-2.9, 2.9), (-3.07, -0.07), (-2.9, 2.9), (-0.02, 3.75), (-2.9, 2.9)];
/// From the last joint to the hand, meters.
const HAND_M: f64 = 0.107;

/// The arm.
pub(super) fn body() -> Result<Body, PlanningError> {
    let link = |(_, from, to, radius_m, count): &(usize, [f64; 3], [f64; 3], f64, usize)| {
        let sphere = |n: usize| {
            let share = n as f64 / (count - 1) as f64;
            let center = |axis: usize| (from[axis] + share * (to[axis] - from[axis])) as f32;
            Sphere { center_m: [0, 1, 2].map(center), radius_m: *radius_m as f32 }
        };
        Link { spheres: (0..*count).map(sphere).collect(), ..Link::default() }
    };
    Body::new(ROWS.iter().map(link).collect())
}

/// `count` configurations of random angles, on bases that stand upright at random places.
pub(super) fn configurations(surface: &Surface, count: usize, random: &mut ChaCha8Rng) -> Vec<f32> {
    let mut numbers = Vec::with_capacity(count * ROWS.len() * 7);
    for _ in 0..count {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, random.random_range(-3.0..3.0));
        let base = Pose::from_parts(Translation3::from(Vector3::from(surface.near(random))), turn);
        let angles = ANGLES.map(|(low, high)| random.random_range(low..high));
        chain(&base, angles).iter().for_each(|pose| append(&mut numbers, pose));
    }
    numbers
}

/// Where the links are: base, seven links, hand and two fingers.
fn chain(base: &Pose, angles: [f64; 7]) -> Vec<Pose> {
    let mut poses = vec![*base];
    let mut last = *base;
    for ((a, alpha, d), angle) in JOINTS.into_iter().zip(angles) {
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        last = last
            * Pose::from_parts(Translation3::new(a, 0.0, 0.0), tilt * UnitQuaternion::identity())
            * Pose::from_parts(Translation3::from(turn * Vector3::new(0.0, 0.0, d)), turn);
        poses.push(last);
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -FRAC_PI_4);
    let hand = last * Pose::from_parts(Translation3::new(0.0, 0.0, HAND_M), turn);
    poses.extend([hand, hand, hand]);
    poses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arm_has_59_spheres_and_stretches_as_far_as_its_links_do() {
        let arm = body().unwrap();
        assert_eq!(arm.links().iter().map(|link| link.spheres.len()).sum::<usize>(), 59);
        let poses = chain(&Pose::identity(), [0.0; 7]);
        assert_eq!(poses.len(), arm.links().len());
        let flange = poses[8].translation.vector;
        assert!(
            (flange - Vector3::new(0.088, 0.0, 0.333 + 0.316 + 0.384 - HAND_M)).norm() < 1e-9,
            "{flange}"
        );
    }
}
