//! An arm of seven joints with a gripper, of the size of those that stand beside benches: 59 spheres.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::place::{Surface, append};
use mrol_map::geometry::Pose;
use mrol_map::planning::{Body, Link, NUMBERS_PER_POSE, PlanningError, Sphere};

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
/// Spheres of the arm.
const SPHERES: usize = 59;
/// From the last joint to the hand, meters.
const HAND_M: f64 = 0.107;
/// The last link before the hand.
const FLANGE: usize = 7;

/// Whether the hand moves by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hand {
    /// Hand and fingers are links: 11 in all.
    Moves,
    /// They are parts of the last link: 8 in all.
    IsStiff,
}

impl Hand {
    /// Links of the arm.
    pub(crate) fn links(self) -> usize {
        match self {
            Self::Moves => ROWS.len(),
            Self::IsStiff => FLANGE + 1,
        }
    }
}

/// The arm.
pub(crate) fn body(hand: Hand) -> Result<Body, PlanningError> {
    let mut links = vec![Link::default(); hand.links()];
    for row in &ROWS {
        let (link, frame) = match hand {
            Hand::IsStiff if row.0 > FLANGE => (FLANGE, hand_at()),
            _ => (row.0, Pose::identity()),
        };
        links[link].spheres.extend(spheres(row, &frame));
    }
    Body::new(links)
}

/// The spheres of a row whose frame lies so in that of the link.
fn spheres((_, from, to, radius_m, count): &Row, frame: &Pose) -> impl Iterator<Item = Sphere> {
    (0..*count).map(move |n| {
        let share = n as f64 / (count - 1) as f64;
        let center = [0, 1, 2].map(|axis: usize| from[axis] + share * (to[axis] - from[axis]));
        let center = frame * Point3::from(center);
        Sphere { center_m: [center.x, center.y, center.z].map(|c| c as f32), radius_m: *radius_m as f32 }
    })
}

/// The hand in the last link.
fn hand_at() -> Pose {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -FRAC_PI_4);
    Pose::from_parts(Translation3::new(0.0, 0.0, HAND_M), turn)
}

/// `count` configurations of random angles, on bases that stand upright at random places.
pub(crate) fn configurations(
    hand: Hand,
    surface: &Surface,
    count: usize,
    random: &mut ChaCha8Rng,
) -> Vec<f32> {
    let mut numbers = Vec::with_capacity(count * hand.links() * NUMBERS_PER_POSE);
    for _ in 0..count {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, random.random_range(-3.0..3.0));
        let base = Pose::from_parts(Translation3::from(Vector3::from(surface.near(random))), turn);
        let angles = ANGLES.map(|(low, high)| random.random_range(low..high));
        chain(&base, angles).iter().take(hand.links()).for_each(|pose| append(&mut numbers, pose));
    }
    numbers
}

/// The spheres of an arm in the map frame: x y z and radius of each.
pub(crate) fn spheres_at(arm: &Body, poses: &[f32]) -> [f32; 4 * SPHERES] {
    let links = arm.links().iter().zip(poses.as_chunks::<NUMBERS_PER_POSE>().0);
    let placed = links.flat_map(|(link, pose)| {
        let [px, py, pz, x, y, z, w] = pose.map(f64::from);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let map_from_link = Pose::from_parts(Translation3::new(px, py, pz), turn);
        link.spheres.iter().flat_map(move |sphere| {
            let center = map_from_link * Point3::from(sphere.center_m.map(f64::from));
            [center.x as f32, center.y as f32, center.z as f32, sphere.radius_m]
        })
    });
    let (mut numbers, mut all) = ([0.0; 4 * SPHERES], placed);
    numbers.fill_with(|| all.next().unwrap_or_default());
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
    let hand = last * hand_at();
    poses.extend([hand, hand, hand]);
    poses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arm_has_59_spheres_and_stretches_as_far_as_its_links_do() {
        for hand in [Hand::Moves, Hand::IsStiff] {
            let arm = body(hand).unwrap();
            assert_eq!(arm.links().iter().map(|link| link.spheres.len()).sum::<usize>(), 59);
            assert_eq!(arm.links().len(), hand.links());
        }
        let poses = chain(&Pose::identity(), [0.0; 7]);
        assert_eq!(poses.len(), Hand::Moves.links());
        let flange = poses[8].translation.vector;
        assert!(
            (flange - Vector3::new(0.088, 0.0, 0.333 + 0.316 + 0.384 - HAND_M)).norm() < 1e-9,
            "{flange}"
        );
    }
}
