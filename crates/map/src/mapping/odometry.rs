//! How far off a guess may be of which nobody says: what odometry errs by, and how far a robot goes in a time.

use crate::align::PoseCovariance;
use crate::geometry::Pose;

/// Largest share of a motion that odometry may err by.
pub const ODOMETRY_SHARE_MAX: f64 = 10.0;

/// How far off a robot's odometry is, and how fast the robot moves.
///
/// They speak for poses near the guess where a scan fits at several, and rule nothing out: wheels slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometrySettings {
    /// Standard deviation of a motion's length, as a share of it. 0.1.
    pub way_share: f64,
    /// Standard deviation of a motion's turn, as a share of it. 0.1.
    pub turn_share: f64,
    /// How far a robot goes in a second without odometry, meters: three standard deviations. 10.
    pub speed_max_m_per_s: f64,
    /// How far it turns in a second, degrees: three standard deviations. 180.
    pub turn_max_deg_per_s: f64,
}

impl Default for OdometrySettings {
    fn default() -> Self {
        Self { way_share: 0.1, turn_share: 0.1, speed_max_m_per_s: 10.0, turn_max_deg_per_s: 180.0 }
    }
}

/// Why settings of odometry are not valid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum OdometrySettingsError {
    /// A share is out of range.
    #[error("{name} must lie in 0 to {ODOMETRY_SHARE_MAX}, got {value}")]
    Share {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

impl OdometrySettings {
    /// Checks the numbers, and returns the settings.
    ///
    /// # Errors
    /// Names what is out of range.
    pub fn checked(self) -> Result<Self, OdometrySettingsError> {
        let shares = [("odometry_way_share", self.way_share), ("odometry_turn_share", self.turn_share)];
        match shares.into_iter().find(|(_, value)| !(0.0..=ODOMETRY_SHARE_MAX).contains(value)) {
            Some((name, value)) => Err(OdometrySettingsError::Share { name, value }),
            None => Ok(self),
        }
    }

    /// How far off a motion (before_from_now) may be that odometry tells.
    pub(super) fn of_motion(&self, motion: &Pose) -> PoseCovariance {
        let way_m = self.way_share * motion.translation.vector.norm();
        PoseCovariance::isotropic(way_m, self.turn_share * motion.rotation.angle())
    }

    /// How far from where it was a robot may be after so many seconds without odometry.
    pub fn after(&self, seconds: f64) -> PoseCovariance {
        let turn_rad = self.turn_max_deg_per_s.to_radians() * seconds / 3.0;
        PoseCovariance::isotropic(self.speed_max_m_per_s * seconds / 3.0, turn_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::PosePrior;
    use nalgebra::Vector3;

    #[test]
    fn half_a_turn_is_likely_after_two_seconds_and_not_after_half_a_one() {
        let turned = Pose::new(Vector3::zeros(), Vector3::z() * std::f64::consts::PI);
        let deviations = |seconds| {
            let expected = Some(OdometrySettings::default().after(seconds));
            PosePrior { expected, ..Pose::identity().into() }.deviations(&turned, 0.1)
        };
        assert!((deviations(2.0) - 1.5).abs() < 0.01, "{}", deviations(2.0));
        assert!((deviations(0.5) - 6.0).abs() < 0.01, "{}", deviations(0.5));
    }
}
