//! The prior of an alignment: what is known of a scan's pose before it is looked at.

use nalgebra::{Matrix6, SymmetricEigen, UnitQuaternion, Vector3, Vector6};

use super::gravity::Gravity;
use super::settings::AlignmentSettings;
use crate::geometry::Pose;

/// What is known of a scan's pose beforehand: where it is thought to have been taken, how far off that may be, and
/// which way is down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosePrior {
    /// Where the scan is thought to have been taken: map_from_sensor.
    pub guess: Pose,
    /// How far off the guess may be; without, as far as an alignment looks.
    pub covariance: Option<PoseCovariance>,
    /// How far off it is expected to be where no covariance says so: it speaks for poses near the guess, and rules none
    /// out.
    pub expected: Option<PoseCovariance>,
    /// The robot may have turned unseen, so that the guess tells nothing of which way it looks, where no covariance
    /// does: as after a time that nobody knows, since its last pose.
    pub may_have_turned: bool,
    /// Direction of gravity, as an accelerometer tells.
    pub gravity: Option<Gravity>,
}

/// Covariance of a pose, as ROS has it in `PoseWithCovariance`: x y z (meters, along the map's axes), then turns about
/// these axes through the sensor (radians).
///
/// A guess is not nearer to the truth than it is to be found: to each variance comes that of a voxel or a degree, so
/// that a robot on a plane may say zero of its height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseCovariance(Matrix6<f64>);

/// Why numbers are no covariance.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PoseCovarianceError {
    /// Not 36 numbers.
    #[error("covariance must have 36 numbers, 6 rows of 6, got {0}")]
    Length(usize),
    /// A number that is not finite.
    #[error("covariance must be finite, got {2} in row {0}, column {1}")]
    NotFinite(usize, usize, f64),
    /// Two numbers that should be the same.
    #[error("covariance must be symmetric, got {2} in row {0}, column {1}, and {3} the other way round")]
    NotSymmetric(usize, usize, f64, f64),
    /// A direction with a negative variance.
    #[error("covariance must be positive semidefinite, got a variance of {0} in some direction")]
    Negative(f64),
}

/// How far two numbers of a matrix may differ that should be the same, and how far below zero a variance may be, as a
/// share of the largest.
const ROUNDING: f64 = 1e-6;

impl PoseCovariance {
    /// A covariance of its 36 numbers, row by row.
    ///
    /// # Errors
    /// When the matrix is not finite, symmetric and positive semidefinite.
    pub fn new(rows: &[f64]) -> Result<Self, PoseCovarianceError> {
        let rows: &[f64; 36] = rows.try_into().map_err(|_| PoseCovarianceError::Length(rows.len()))?;
        if let Some(k) = rows.iter().position(|number| !number.is_finite()) {
            return Err(PoseCovarianceError::NotFinite(k / 6, k % 6, rows[k]));
        }
        let matrix = Matrix6::from_row_slice(rows);
        let largest = matrix.abs().max();
        for (i, j) in (0..6).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let (a, b) = (matrix[(i, j)], matrix[(j, i)]);
            // Of the largest numbers the difference is no number.
            if (a - b).abs() > ROUNDING * largest || !(a - b).is_finite() {
                return Err(PoseCovarianceError::NotSymmetric(i, j, a, b));
            }
        }
        if largest > 0.0 {
            let least = SymmetricEigen::new(matrix / largest).eigenvalues.min();
            if least.is_nan() || least < -ROUNDING {
                return Err(PoseCovarianceError::Negative(least * largest));
            }
        }
        Ok(Self(matrix))
    }

    /// That of a pose which may be off by these standard deviations in every direction and about every axis: in place
    /// and tilt at most by those of a pose of which nothing is known. A robot may have turned all the way around.
    pub fn isotropic(std_m: f64, std_rad: f64) -> Self {
        let (meters, tilt, yaw) = (
            std_m.clamp(0.0, WIDE_M),
            std_rad.clamp(0.0, WIDE_DEG.to_radians()),
            std_rad.clamp(0.0, OPEN_RAD),
        );
        let deviations = Vector6::new(meters, meters, meters, tilt, tilt, yaw);
        Self(Matrix6::from_diagonal(&deviations.component_mul(&deviations)))
    }

    /// That of a guess of which nothing else is known.
    fn wide() -> Self {
        Self::isotropic(WIDE_M, WIDE_DEG.to_radians())
    }

    /// This covariance, of which the turn about the map's z axis is not known.
    fn with_open_yaw(mut self) -> Self {
        self.0.row_mut(5).fill(0.0);
        self.0.column_mut(5).fill(0.0);
        self.0[(5, 5)] = OPEN_RAD * OPEN_RAD;
        self
    }

    /// The 36 numbers, row by row.
    pub fn rows(&self) -> [f64; 36] {
        std::array::from_fn(|k| self.0[(k / 6, k % 6)])
    }

    /// How many standard deviations `pose` is from `guess` (map_from_sensor), where a pose is found to within `found_m`
    /// and `found_rad` anyway.
    fn deviations(&self, guess: &Pose, pose: &Pose, found_m: f64, found_rad: f64) -> f64 {
        let shift = pose.translation.vector - guess.translation.vector;
        let turn = (pose.rotation * guess.rotation.inverse()).scaled_axis();
        let difference = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
        let (meters, radians) = (found_m * found_m, found_rad * found_rad);
        let found = Matrix6::from_diagonal(&Vector6::new(meters, meters, meters, radians, radians, radians));
        // Of numbers so large that the sum is none, nothing is known.
        match (self.0 + found).cholesky() {
            Some(factor) => difference.dot(&factor.solve(&difference)).max(0.0).sqrt(),
            None => 0.0,
        }
    }
}

/// Angle to which a pose is found, degrees: see [`PoseCovariance`].
const FOUND_DEG: f64 = 1.0;

/// Standard deviations of a guess of which nothing else is known: meters and degrees.
pub(super) const WIDE_M: f64 = 2.0;
pub(super) const WIDE_DEG: f64 = 40.0;
/// Three standard deviations of a yaw that may be another one altogether, degrees.
const YAW_OPEN_DEG: f64 = 30.0;
/// Standard deviation of a turn of which nothing is known, radians: no turn is farther than one of them.
const OPEN_RAD: f64 = 100.0;

impl From<Pose> for PosePrior {
    /// A guess of which nothing else is known.
    fn from(guess: Pose) -> Self {
        Self { guess, covariance: None, expected: None, may_have_turned: true, gravity: None }
    }
}

impl PosePrior {
    /// The guess, turned by as little as possible so that gravity points down in the map.
    pub fn leveled_guess(&self) -> Pose {
        let Some(gravity) = self.gravity else { return self.guess };
        let down = self.guess.rotation * gravity.in_sensor;
        // Of opposite directions no turn is the least one: the guess stands on its head, and tells nothing.
        let Some(turn) = UnitQuaternion::rotation_between_axis(&down, &gravity.in_map) else {
            return self.guess;
        };
        Pose::from_parts(self.guess.translation, turn * self.guess.rotation)
    }

    /// How far off the guess may be, by all that is known of it.
    fn spread(&self) -> PoseCovariance {
        self.covariance.or(self.expected).unwrap_or_else(PoseCovariance::wide)
    }

    /// How many standard deviations of what is known beforehand `pose` (map_from_sensor) is from the guess. Voxels of
    /// the finest level have sides of `resolution_m`.
    pub(crate) fn deviations(&self, pose: &Pose, resolution_m: f64) -> f64 {
        let covariance = self.spread();
        covariance.deviations(&self.leveled_guess(), pose, resolution_m, FOUND_DEG.to_radians())
    }

    /// True where the scan may have been taken turned by a step of the yaws that are tried.
    pub(super) fn leaves_yaw_open(&self) -> bool {
        let variance = self.spread().0[(5, 5)];
        let is_told = self.covariance.is_some() || self.expected.is_some();
        3.0 * variance.sqrt() >= YAW_OPEN_DEG.to_radians() && (is_told || self.may_have_turned)
    }

    /// True where the robot may have turned, and nothing tells how far: neither odometry, nor a time, nor a covariance.
    pub(super) fn tells_no_turn(&self) -> bool {
        self.may_have_turned && self.covariance.is_none() && self.expected.is_none()
    }

    /// Three standard deviations along a direction (of length 1, map frame), meters.
    pub(super) fn possible_m(&self, axis: Vector3<f64>) -> f64 {
        let covariance = self.spread();
        let along = Vector6::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0);
        3.0 * along.dot(&(covariance.0 * along)).max(0.0).sqrt()
    }

    /// This prior, of which the turn about the map's z axis is not known.
    pub(super) fn with_open_yaw(self) -> Self {
        let covariance = self.spread();
        Self { covariance: None, expected: Some(covariance.with_open_yaw()), ..self }
    }

    /// True of a pose (map_from_sensor) that contradicts what is known of it beforehand. Voxels of the finest level
    /// have sides of `resolution_m`.
    pub fn rules_out(&self, pose: &Pose, resolution_m: f64, settings: &AlignmentSettings) -> bool {
        self.against(pose, resolution_m, settings).is_some()
    }

    /// Why a pose (map_from_sensor) contradicts what is known of it beforehand; none where it does not. Voxels of the
    /// finest level have sides of `resolution_m`.
    pub(super) fn against(
        &self,
        pose: &Pose,
        resolution_m: f64,
        settings: &AlignmentSettings,
    ) -> Option<String> {
        let most = settings.covariance_deviations_max;
        if let Some(covariance) = self.covariance {
            let found_rad = FOUND_DEG.to_radians();
            // What gravity says of the guess does not count as a deviation from it.
            let deviations = covariance.deviations(&self.leveled_guess(), pose, resolution_m, found_rad);
            if deviations > most {
                let words = "standard deviations of its covariance from the guess";
                return Some(format!("it is {deviations:.1} {words}, at most {most} are accepted"));
            }
        }
        let gravity = self.gravity?;
        let degrees = (pose.rotation * gravity.in_sensor).angle(&gravity.in_map).to_degrees();
        let most = settings.gravity_error_max_deg;
        (degrees > most)
            .then(|| format!("gravity would be {degrees:.1} deg off there, at most {most} deg are accepted"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::gravity::MAP_DOWN;
    use nalgebra::Vector3;

    fn diagonal(variances: [f64; 6]) -> [f64; 36] {
        std::array::from_fn(|k| if k % 7 == 0 { variances[k / 7] } else { 0.0 })
    }

    fn prior(variances: [f64; 6]) -> PosePrior {
        let covariance = Some(PoseCovariance::new(&diagonal(variances)).unwrap());
        PosePrior { covariance, ..Pose::translation(1.0, 2.0, 0.0).into() }
    }

    fn against(prior: &PosePrior, pose: &Pose) -> Option<String> {
        prior.against(pose, 0.05, &AlignmentSettings::default())
    }

    #[test]
    fn numbers_that_are_no_covariance_are_named() {
        let message = |rows: &[f64]| PoseCovariance::new(rows).unwrap_err().to_string();
        assert!(message(&[1.0; 35]).contains("36 numbers, 6 rows of 6, got 35"));
        let with = |k: usize, number: f64| {
            let mut rows = diagonal([1.0; 6]);
            rows[k] = number;
            rows
        };
        assert!(message(&with(7, f64::NAN)).contains("got NaN in row 1, column 1"));
        assert!(message(&with(6, 0.5)).contains("row 1, column 0, and 0 the other way round"));
        assert!(message(&with(0, -1.0)).contains("a variance of -1"));
        let mut huge = diagonal([f64::MAX; 6]);
        (huge[1], huge[6]) = (f64::MAX, -f64::MAX);
        assert!(message(&huge).contains("symmetric"));
        for fine in [[0.0; 6], [1e-300; 6], [1e300; 6], [1.0, 1.0, 0.0, 0.0, 0.0, 0.01]] {
            let covariance = PoseCovariance::new(&diagonal(fine)).unwrap();
            assert_eq!(covariance.rows(), diagonal(fine));
        }
    }

    #[test]
    fn a_pose_is_as_far_from_the_guess_as_its_covariance_allows() {
        let prior = prior([1.0, 0.01, 0.0, 0.0, 0.0, 0.01]);
        let at = |x, y, yaw| Pose::new(Vector3::new(x, y, 0.0), Vector3::new(0.0, 0.0, yaw));
        assert_eq!(against(&prior, &at(1.0, 2.0, 0.0)), None);
        assert_eq!(against(&prior, &at(4.0, 2.0, 0.0)), None);
        assert_eq!(against(&prior, &at(1.0, 2.0, 0.4)), None);
        let reason = against(&prior, &at(1.0, 3.0, 0.0)).unwrap();
        assert!(reason.contains("8.9 standard deviations"), "{reason}");
        assert!(against(&prior, &at(1.0, 2.0, 0.7)).is_some());
        // Of its height it is sure, but nobody knows a pose to better than a voxel.
        assert_eq!(against(&prior, &Pose::translation(1.0, 2.0, 0.1)), None);
        assert!(against(&prior, &Pose::translation(1.0, 2.0, 0.5)).is_some());
        // One that knows nothing bounds nothing.
        assert_eq!(against(&self::prior([1e300; 6]), &at(1e3, 0.0, 3.0)), None);
    }

    #[test]
    fn a_guess_is_leveled_and_a_pose_that_gravity_contradicts_is_told() {
        let tilted = Pose::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.2, 0.0, 0.9));
        let level = Pose::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.0, 0.0, 0.9));
        let gravity = Some(Gravity::new([0.0, 0.0, -9.81], MAP_DOWN).unwrap());
        let prior = PosePrior { gravity, ..tilted.into() };
        let leveled = prior.leveled_guess();
        assert_eq!(leveled.translation, tilted.translation);
        assert!((leveled.rotation * Vector3::z()).z > 1.0 - 1e-12);
        assert_eq!(against(&prior, &level), None);
        let reason = against(&prior, &tilted).unwrap();
        assert!(reason.contains("gravity would be 11."), "{reason}");
        // On its head no turn is the least: it stays as it is, and is refused.
        let on_its_head =
            PosePrior { guess: Pose::rotation(Vector3::new(std::f64::consts::PI, 0.0, 0.0)), ..prior };
        assert!(
            against(&on_its_head, &on_its_head.leveled_guess()).is_some_and(|reason| reason.contains("180"))
                || (on_its_head.leveled_guess().rotation * Vector3::z()).z > 0.99
        );
        assert_eq!(PosePrior::from(tilted).leveled_guess(), tilted);
    }
}
