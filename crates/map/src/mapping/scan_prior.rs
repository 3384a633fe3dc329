//! What is known of the pose of a scan before it is aligned.

use super::guess::Guess;
use super::resolved_guess::last_seen;
use super::scan::Scan;
use super::scan_mapper::ScanMapper;
use crate::align::PosePrior;
use crate::geometry::Pose;

impl ScanMapper<'_> {
    /// What is known of the pose of a scan whose guess stands for `guess` (map_from_sensor).
    pub(super) fn prior(&self, scan: &Scan<'_>, guess: Pose) -> PosePrior {
        let odometry = &self.settings.odometry;
        let expected = match &scan.guess {
            Guess::Motion(last_from_sensor) => Some(odometry.of_motion(last_from_sensor)),
            Guess::Last | Guess::ConstantVelocity => {
                self.seconds_since_last(scan).map(|seconds| odometry.after(seconds))
            }
            // Whoever tells a pose may have found it anywhere.
            Guess::Pose(_) => None,
        };
        // Whoever tells a pose tells which way the robot looks.
        let may_have_turned = !matches!(scan.guess, Guess::Pose(_));
        PosePrior {
            guess,
            covariance: scan.guess_covariance,
            expected,
            may_have_turned,
            gravity: scan.gravity,
        }
    }

    /// Seconds since the robot's last good pose; none where a time is not known.
    fn seconds_since_last(&self, scan: &Scan<'_>) -> Option<f64> {
        let (_, last_ns) = last_seen(scan.robot, &self.map.trajectory(), self.sightings)?;
        seconds_between(last_ns, scan.timestamp_ns)
    }
}

/// Seconds from one time to a later one, nanoseconds since the Unix epoch; none where one is not known, or none is
/// later.
pub(super) fn seconds_between(before_ns: Option<i64>, now_ns: Option<i64>) -> Option<f64> {
    let elapsed_ns = now_ns?.checked_sub(before_ns?).filter(|ns| *ns > 0)?;
    Some(elapsed_ns as f64 * 1e-9)
}
