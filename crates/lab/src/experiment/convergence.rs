//! Experiment on the region of convergence: from how far off a guess an alignment finds the pose (paper III-B).

use std::time::Instant;

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use mrol_map::align::{AlignmentSettings, Verdict, align};
use mrol_map::geometry::{Point, Pose, pose_difference};
use mrol_map::map::MultiResolutionMap;
use mrol_simulate::gaussian;

/// Largest distance of a guess from the truth, meters.
pub const OFFSET_MAX_M: f64 = 2.0;
/// The largest rotation of a guess from the truth, degrees.
pub const OFFSET_MAX_DEG: f64 = 40.0;
/// An alignment has converged within this distance of the truth, meters.
pub const CONVERGED_M: f64 = 0.1;
/// An alignment has converged within this rotation of the truth, degrees.
pub const CONVERGED_DEG: f64 = 1.0;

/// A guess, with its distance and angle from the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffGuess {
    /// The guess, map_from_sensor.
    pub guess: Pose,
    /// Distance of the guess from the true position, meters.
    pub offset_m: f64,
    /// Angle between the guess and the true rotation, degrees.
    pub offset_deg: f64,
}

/// `count` guesses around the pose `truth`: shifted in a uniform direction and turned about a uniform axis through the
/// sensor, the distance and the angle uniform up to [`OFFSET_MAX_M`] and [`OFFSET_MAX_DEG`].
pub fn guesses_around(truth: &Pose, count: usize, seed: u64) -> Vec<OffGuess> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut guess = || {
        let offset_m = random.random_range(0.0..OFFSET_MAX_M);
        let offset_deg = random.random_range(0.0..OFFSET_MAX_DEG);
        let shift = direction(&mut random) * offset_m;
        let turn = UnitQuaternion::from_scaled_axis(direction(&mut random) * offset_deg.to_radians());
        let place = Translation3::from(shift) * truth.translation;
        OffGuess { guess: Pose::from_parts(place, turn * truth.rotation), offset_m, offset_deg }
    };
    (0..count).map(|_| guess()).collect()
}

/// A direction drawn uniformly from the unit sphere.
pub(super) fn direction(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| gaussian(random)).normalize()
}

/// Result of one alignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Distance of the result from the true position, meters.
    pub error_m: f64,
    /// Angle between the result and the true rotation, degrees.
    pub error_deg: f64,
    /// Verdict of the alignment.
    pub verdict: Verdict,
    /// Duration of the alignment, milliseconds.
    pub ms: f64,
}

impl Trial {
    /// Aligns `points` (sensor frame, finite), taken at `truth`, from `guess`.
    pub fn of(
        map: &MultiResolutionMap,
        points: &[Point],
        truth: &Pose,
        guess: &Pose,
        settings: &AlignmentSettings,
    ) -> Self {
        let start = Instant::now();
        let alignment = align(map, points, guess, settings);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let (error_m, error_deg) = pose_difference(&alignment.map_from_sensor, truth);
        Self { error_m, error_deg, verdict: alignment.verdict, ms }
    }

    /// True when it ended within [`CONVERGED_M`] and [`CONVERGED_DEG`] of the truth.
    pub fn converged(&self) -> bool {
        self.error_m <= CONVERGED_M && self.error_deg <= CONVERGED_DEG
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guesses_are_as_far_off_as_they_say_and_fill_the_range() {
        let truth = Pose::new(Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.3, 0.1, -2.0));
        let guesses = guesses_around(&truth, 400, 1);
        for OffGuess { guess, offset_m, offset_deg } in &guesses {
            let (meters, degrees) = pose_difference(guess, &truth);
            assert!((meters - offset_m).abs() < 1e-9 && (degrees - offset_deg).abs() < 1e-5);
        }
        let share =
            |is_far: fn(&OffGuess) -> bool| guesses.iter().filter(|g| is_far(g)).count() as f64 / 400.0;
        assert!((share(|g| g.offset_m > 1.0) - 0.5).abs() < 0.1);
        assert!((share(|g| g.offset_deg > 20.0) - 0.5).abs() < 0.1);
        assert!((share(|g| g.guess.translation.x > 1.0) - 0.5).abs() < 0.1);
        assert_ne!(guesses, guesses_around(&truth, 400, 2));
    }

    #[test]
    fn a_trial_converges_where_both_errors_are_small() {
        let trial = |error_m, error_deg| Trial { error_m, error_deg, verdict: Verdict::Accepted, ms: 1.0 };
        assert!(trial(0.1, 1.0).converged());
        assert!(!trial(0.11, 0.0).converged() && !trial(0.0, 1.1).converged());
    }
}
