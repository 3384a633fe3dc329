//! Simulated odometry with drift, for sequences without odometry.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use mrol_map::geometry::{Pose, pose_difference};
use mrol_simulate::gaussian;

/// Standard deviation of a step's translation along each axis, as a share of the step's length.
const SHIFT: f64 = 0.02;
/// Standard deviation of a step's rotation about each axis, as a share of the step's angle.
const TURN: f64 = 0.02;
const TURN_DEG_PER_M: f64 = 0.5;

/// Simulates the odometry of a sensor that moved along `truth` (map_from_sensor). Each step has an error drawn from
/// `seed`, with standard deviations of 2 % of its length along each axis, and of 2 % of its rotation plus half a degree
/// a meter about each axis.
pub fn drifting(truth: &[Pose], seed: u64) -> Vec<Pose> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |std: f64| Vector3::from_fn(|_, _| std * gaussian(&mut random));
    let Some(&first) = truth.first() else { return Vec::new() };
    let mut poses = vec![first];
    let mut last = first;
    for step in truth.windows(2) {
        let (meters, degrees) = pose_difference(&step[0], &step[1]);
        let shift = Translation3::from(normal(SHIFT * meters));
        let turn_deg = normal(TURN * degrees + TURN_DEG_PER_M * meters);
        let error = Pose::from_parts(shift, UnitQuaternion::from_scaled_axis(turn_deg.map(f64::to_radians)));
        last = last * step[0].inv_mul(&step[1]) * error;
        poses.push(last);
    }
    poses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_odometry_drifts_by_a_few_percent_of_the_way_and_stands_still_with_the_robot() {
        let truth: Vec<_> = (0..200).map(|i| Pose::translation(f64::from(i) * 0.1, 0.0, 0.0)).collect();
        let poses = drifting(&truth, 1);
        assert_eq!((poses.len(), poses[0]), (200, truth[0]));
        let (meters, degrees) = pose_difference(&poses[199], &truth[199]);
        assert!((0.01..2.0).contains(&meters) && (0.05..10.0).contains(&degrees), "{meters} m {degrees} deg");
        assert_eq!(poses, drifting(&truth, 1));
        assert_ne!(poses, drifting(&truth, 2));
        assert_eq!(drifting(&[truth[5]; 3], 1), [truth[5]; 3]);
        assert!(drifting(&[], 1).is_empty());
    }
}
