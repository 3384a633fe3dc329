//! Guesses by odometry.

use super::logged_scan::LoggedScan;
use mrol_map::geometry::{Pose, is_finite};
use mrol_map::mapping::Guess;

/// The way of the sensor since its last accepted scan, as its odometry tells.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Odometer {
    /// Where the sensor was at its last accepted scan: odometry_from_sensor.
    last: Option<Pose>,
}

impl Odometer {
    /// The guess of a scan: the motion since the last accepted scan. None where the odometry does not tell one.
    pub fn guess(&self, scan: &LoggedScan) -> Option<Guess> {
        let (last, now) = (self.last?, scan.odometry_from_sensor?);
        // Of poses as far away as numbers go, the motion is none.
        Some(last.inv_mul(&now)).filter(is_finite).map(Guess::Motion)
    }

    /// Notes a scan that the map accepted: the next guess counts from it.
    pub fn accepted(&mut self, scan: &LoggedScan) {
        self.last = scan.odometry_from_sensor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_motion_counts_from_the_last_accepted_scan() {
        let scan = |x: Option<f64>| LoggedScan {
            stamp_ns: 0,
            points: Vec::new(),
            times_s: None,
            odometry_from_sensor: x.map(|x| Pose::translation(x, 0.0, 0.0)),
            gravity: None,
        };
        let mut odometer = Odometer::default();
        assert_eq!(odometer.guess(&scan(Some(1.0))), None);
        odometer.accepted(&scan(Some(1.0)));
        // The one at 2 m was refused.
        assert_eq!(odometer.guess(&scan(Some(3.0))), Some(Guess::Motion(Pose::translation(2.0, 0.0, 0.0))));
        assert_eq!(odometer.guess(&scan(None)), None);
        odometer.accepted(&scan(Some(-1e308)));
        assert_eq!(odometer.guess(&scan(Some(1e308))), None, "no number is so far");
        odometer.accepted(&scan(None));
        assert_eq!(odometer.guess(&scan(Some(4.0))), None, "from where it went on is not known");
    }
}
