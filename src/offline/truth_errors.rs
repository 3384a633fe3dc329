//! Errors of estimated poses against true ones.

use std::fmt::{self, Display};

use serde::Serialize;

use crate::console::Statistics;
use mrol_map::geometry::{Pose, pose_difference};

/// True poses, and the errors against them so far.
///
/// The error of scan k is that of inv(E_0) E_k against inv(T_0) T_k, where 0 is the first scan that was
/// accepted: it does not matter where the map's origin lies.
pub struct TruthErrors {
    truth: Vec<Pose>,
    /// E_0 and T_0: estimated and true pose of the first accepted scan.
    first: Option<(Pose, Pose)>,
    meters: Vec<f64>,
    degrees: Vec<f64>,
}

/// Summary of the errors.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ErrorSummary {
    /// Of translations, meters.
    pub meters: Statistics,
    /// Of rotations, degrees.
    pub degrees: Statistics,
}

impl TruthErrors {
    /// No errors yet, against the poses of `truth`.
    pub fn new(truth: Vec<Pose>) -> Self {
        Self { truth, first: None, meters: Vec::new(), degrees: Vec::new() }
    }

    /// True pose of scan `k`, T_k.
    pub fn pose(&self, k: usize) -> Pose {
        self.truth[k]
    }

    /// Adds the estimated pose of scan `k`; returns its error, meters and degrees.
    pub fn add(&mut self, k: usize, map_from_sensor: &Pose) -> (f64, f64) {
        let (found_first, true_first) = *self.first.get_or_insert((*map_from_sensor, self.truth[k]));
        let found = found_first.inv_mul(map_from_sensor);
        let error = pose_difference(&true_first.inv_mul(&self.truth[k]), &found);
        self.meters.push(error.0);
        self.degrees.push(error.1);
        error
    }

    /// Returns the summary; none before the first scan.
    pub fn summary(&self) -> Option<ErrorSummary> {
        let meters = Statistics::of(self.meters.clone())?;
        Some(ErrorSummary { meters, degrees: Statistics::of(self.degrees.clone())? })
    }
}

impl Display for ErrorSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { meters: m, degrees: d } = self;
        write!(f, "error: max {:.4} m {:.3} deg, ", m.max, d.max)?;
        write!(f, "median {:.4} m {:.3} deg, rms {:.4} m {:.3} deg", m.median, d.median, m.rms, d.rms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn an_error_does_not_depend_on_the_origin() {
        let pose = |x: f64, yaw: f64| Pose::new(Vector3::new(x, 0.0, 0.0), Vector3::new(0.0, 0.0, yaw));
        let truth = [pose(0.0, 0.0), pose(1.0, 0.2), pose(2.0, 0.4)];
        let elsewhere = Pose::new(Vector3::new(5.0, -3.0, 1.0), Vector3::new(0.1, 0.2, 2.0));
        let mut errors = TruthErrors::new(truth.to_vec());
        // The first scan was refused.
        assert!(errors.add(1, &(elsewhere * truth[1])).0 < 1e-9);
        let off = pose(0.3, 0.01);
        let (meters, degrees) = errors.add(2, &(elsewhere * truth[2] * off));
        assert!((meters - 0.3).abs() < 1e-9 && (degrees - 0.01f64.to_degrees()).abs() < 1e-6);
        assert_eq!(errors.summary().unwrap().meters.max, meters);
    }
}
